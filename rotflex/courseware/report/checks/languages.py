"""In which language a text is written, and the words by which some faults are told: in English and in German.

Of a text in another language, what depends on words is not looked at; :func:`of` says so by None. A new language is an
entry more in :data:`KNOWN`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from rotflex.courseware.report.checks.prose import words

_FEWEST = 5  # words that tell a language; with fewer it is not certain
_CLEARLY = 3  # times as many as of any other language


@dataclass(frozen=True)
class Language:
    """What is looked for in a language. Words stand in small letters.

    Attributes
    ----------
    name : in English
    common : words that stand in every text of it
    may_repeat : words that may stand twice in a row
    draft : notes that are left in a first draft, besides those of every language
    results, procedure : how the heading of such a section begins
    results_in : what says what came out, where it is told what was done
    interprets : what says more than what came out
    buttons : what tells of a program's buttons rather than of an experiment
    vague : "the figure above": a place, where a number should be
    else_whose : words by which a number may be another's, or another time's
    quantities : nouns after which a number has a unit
    joins : small words that may follow a number that has no unit
    misspelt : mistakes that are often made, and in no dictionary
    """

    name: str
    common: frozenset[str]
    may_repeat: frozenset[str]
    draft: re.Pattern[str]
    results: tuple[str, ...]
    procedure: tuple[str, ...]
    results_in: re.Pattern[str]
    interprets: re.Pattern[str]
    buttons: re.Pattern[str]
    vague: re.Pattern[str]
    else_whose: re.Pattern[str]
    quantities: re.Pattern[str]
    joins: re.Pattern[str]
    misspelt: frozenset[str]


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


def _any(*phrases: str) -> re.Pattern[str]:
    return re.compile(rf"(?<!\w)(?:{'|'.join(phrases)})(?!\w)", re.IGNORECASE)


_ENGLISH = Language(
    "English",
    _words(
        "the and of is was were with that which for from this are to in by it as at"
    ),
    frozenset({"had", "that"}),
    _any(r"insert (?:figure|plot|table|value|text|here)", r"to be (?:done|written|completed)", "your text here",
         "blah"),
    ("results", "result", "measurements", "data"),
    ("procedure", "method", "experiment"),
    _any("(?:was|were|is|are) found to be", "we (?:found|obtained|got) (?:that|a|an)", "turned out to be",
         "came out as", r"as (?:figure|fig\.|table|tab\.) \S+ shows"),
    _any(
        "because", "therefore", "thus", "hence", "due to", "(?:this|which) means", "shows? that", "suggests?",
        "indicates?", "as expected", "(?:good|excellent|poor|close) agreement", "agrees? well", "we conclude",
        "it follows that", "surprisingly", "unfortunately", "satisfactory", "successful(?:ly)?", "very good",
        "(?:better|worse) than expected",
    ),
    _any(
        "(?:double-)?click(?:ed|ing)?(?: on)?", r"(?:press(?:ed)?|hit) (?:the )?(?:start|run|stop|enter|play)",
        r"(?:press(?:ed)?|hit|push(?:ed)?) (?:the |a )?\w* ?(?:button|key)", "(?:start|run|stop|play) button",
    ),
    _any(
        "(?:figure|plot|graph|diagram|chart|table|picture) (?:above|below)",
        "(?:above|below|following|next|previous) (?:figure|plot|graph|diagram|chart|table|picture)",
        "equation (?:above|below)", "above equation",
    ),
    _any(
        "instead", "printed", "data ?sheets?", "handbook", "manual", "if", "would", "without", "other", "another",
        "nominal", "expected", "predicted", "desired", "before", "earlier", "literature", "compared", "than",
        "initial(?:ly)?", "assum\\w+", "guess\\w*", "first", "second", "between", "at least", "at most", "up to",
        "true", "real", "published", "given", "corrected", "limit\\w*", "specif\\w+", "should", "must", "for example",
        "not", "no", "rather", r"\d ?(?:%|per ?cent) (?:above|below|higher|lower|larger|smaller|more|less)",
        r"(?:differ|deviat)\w* (?:by|from)",
    ),
    _any("frequency", "voltage", "duration", "length", "mass", "temperature", "current", "speed", "velocity", "force",
         "power", "pressure", "distance", "settling time", "rise time", "sample time", "amplitude",
         "(?:sampled|recorded|measured|taken|stored|read) every"),
    _any("and", "so", "with", "which", "where", "while", "but", "because", "as", "by", "is", "was"),
    _words(
        "recieve recieved recieves seperate seperated seperately occured occuring definately accomodate "
        "acheive acheived measurment measurments calulate calulated calculcated wich teh adn lenght heigth "
        "widht freqency frequencey stiffnes experiement experimant refered prefered dependant untill begining "
        "sucessful succesful neccessary maximium aproximately approximatly equasion parametre similiar usualy "
        "beacuse becuase thier existance persistant independant controler diffrent diference"
    ),
)  # fmt: skip
_GERMAN = Language(
    "German",
    _words(
        "der die das und ist war wurde wurden mit von für aus eine ein einer dem den des im nicht auf zu"
    ),
    frozenset({"die", "der", "das", "den", "dem", "sie", "wir", "ihr"}),
    _any("hier (?:noch|text|bild|abbildung) ?(?:einfügen|ergänzen)?(?= *(?:$|[.!…]))",
         "noch (?:zu )?(?:ergänzen|schreiben)",
         "platzhalter", "bild einfügen"),
    ("ergebnis", "messergebnis", "resultat", "messwerte", "results"),
    ("durchführung", "versuch", "vorgehen", "verfahren", "methode", "procedure"),
    _any("(?:ergab|ergaben|ergibt|ergeben) sich", "stellte sich heraus",
         r"wie (?:abbildung|abb\.|figure|tabelle|tab\.|table) \S+ zeigt"),
    _any(
        "weil", "daher", "deshalb", "folglich", "somit", "aufgrund", "das bedeutet", "was bedeutet",
        r"zeig(?:t|en),? dass", "deutet darauf", "wie erwartet", "wie zu erwarten",
        r"(?:sehr )?gute\w* übereinstimmung",
        r"stimm(?:t|en) (?:sehr )?gut", "leider", "überraschend\\w*", "zufriedenstellend\\w*", "erfolgreich\\w*",
        "sehr gut\\w*", "(?:besser|schlechter) als erwartet",
    ),
    _any("(?:an)?geklickt", "klick(?:t|te|ten|en)", r"(?:start|stopp|enter)\w*[- ]?(?:knopf|taste|button)",
         r"(?:knopf|taste|schaltfläche|button) \w* ?gedrückt"),
    _any(
        r"(?:obige|untenstehende|obenstehende|folgende|nächste|vorige)[nrms]? "
        "(?:abbildung|tabelle|grafik|bild|diagramm)",
        "(?:abbildung|tabelle|grafik|bild|diagramm|gleichung) (?:oben|unten)", r"obige[nrms]? gleichung",
    ),
    _any(
        "statt\\w*", "gedruckte\\w*", "datenblatt\\w*", "handbuch\\w*", "wenn", "falls", "würde\\w*", "wäre\\w*",
        "ohne",
        "andere\\w*", "nominal\\w*", "nenn\\w*", "erwartet\\w*", "vorhergesagt\\w*", "gewünscht\\w*", "soll\\w*",
        "vorher",
        "früher\\w*", "zuvor", "literatur\\w*", "verglichen", "als", "anfang\\w*", "annahme\\w*", "angenommen\\w*",
        "geschätzt\\w*", "erste\\w*", "zweite\\w*", "zwischen", "mindestens", "höchstens", "bis zu", "wahre\\w*",
        "gegeben\\w*", "korrigiert\\w*", "grenz\\w*", "muss", "darf", "beispiel\\w*", "nicht", "kein\\w*",
        r"\d ?(?:%|Prozent) (?:über|unter|höher|niedriger|größer|kleiner|mehr|weniger)", "weich(?:t|en)", "abweich\\w+",
    ),
    _any("frequenz", "eigenfrequenz", "spannung", "dauer", "länge", "masse", "temperatur", "strom", "geschwindigkeit",
         "kraft", "leistung", "druck", "abstand", "einschwingzeit", "anstiegszeit", "abtastzeit", "amplitude",
        ),
    _any("und", "so", "mit", "woraus", "wobei", "während", "aber", "weil", "da", "ist", "war"),
    _words(
        "standart seperat wiederspiegelt wiederspiegeln orginal vorraus vorraussetzung rythmus rytmus "
        "parralel paralell maximun addresse aggresiv entgültig garnicht nähmlich ensteht enstanden "
        "funktionert messsung frequnez spanung regelung's"
    ),
)  # fmt: skip

KNOWN = {"en": _ENGLISH, "de": _GERMAN}  #: code of a language → what is looked for in it


def of(texts: Iterable[str], otherwise: str = "") -> Language | None:
    """The language that texts are written in; None where it is none of those that are known.

    Parameters
    ----------
    texts : running text
    otherwise : code of the language that is taken where there are too few words to tell; "" for none
    """
    said = [word.casefold() for text in texts for word in words(text)]
    counts = sorted(((sum(word in one.common for word in said), code) for code, one in KNOWN.items()), reverse=True)
    (most, code), (next_most, _code) = counts[:2]
    if most >= _FEWEST and most >= _CLEARLY * next_most and most >= len(said) / 10:
        return KNOWN[code]
    return KNOWN.get(otherwise) if len(said) < 4 * _FEWEST else None
