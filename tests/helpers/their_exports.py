"""Exports of learning platforms, made up from what their documentation and their own importers say of them.

The students are those of :func:`class_of_four`. In each file one column takes marks, some rows are nobody's of ours,
and something is there that a careless writer would lose: quotes, names with commas, line breaks, empty lines.
"""

import codecs
from pathlib import Path

from gradebooks import graded, mark, prose, record

from labcourse.grading.gradebook import Gradebook

ROSTER = (
    "Student ID,Name,Email,Username,Canvas user ID,Identifier\n"
    "s1001,Ada Lovelace,ada@x.org,alovelace,71,Participant 501\n"
    "s1002,Bob O'Neil,bob@x.org,boneil,72,Participant 502\n"
    "s1003,Cleo Ünal,cleo@x.org,cunal,73,Participant 503\n"
    "s1004,Eve Eden,eve@x.org,eeden,74,Participant 504\n"
)

CANVAS = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Notes,Lab 3 (1234),Quiz (99),Current Score,Final Score\r\n"
    ",,,,,,Manual Posting,,,\r\n"
    "    Points Possible,,,,,,100.00,10.00,(read only),(read only)\r\n"
    '"Lovelace, Ada",71,s1001,alovelace,Lab A,"says ""hi"", twice",,8,80,40\r\n'
    '"O\'Neil, Bob",72,s1002,boneil,Lab A,,40.00,7,70,35\r\n'
    '"Ünal, Cleo",73,s1003,cunal,"Lab A, Lab B",,,9,90,45\r\n'
    '"Eden, Eve",74,s1004,eeden,Lab B,"two\nlines",EX,,,\r\n'
    '"Student, Test",999,,f00ba4,Lab A,,,,,\r\n'
    "\r\n\r\n"
)

MOODLE = (
    '"First name","Last name","ID number",Institution,Department,"Email address","Assignment: Lab 3 (Real)",'
    '"Assignment: Lab 3 (Feedback)","Quiz: Start (Real)","Course total (Real)","Last downloaded from this course"\n'
    'Ada,Lovelace,s1001,,,ada@x.org,-,"Well,\nand so on",5.00,5.00,1795000000\n'
    "Bob,O'Neil,,,,bob@x.org,40.00,,-,-,1795000000\n"
    "Cleo,Ünal,s1003,,,cleo@x.org,-,,-,-,1795000000\n"
    "Zoe,Zorn,s2000,,,zoe@x.org,-,,-,-,1795000000\n"
)

WORKSHEET = (
    'Identifier,"Full name","Email address",Status,Grade,"Maximum Grade","Grade can be changed",'
    '"Last modified (submission)","Last modified (grade)","Feedback comments"\n'
    '"Participant 501","Ada Lovelace",ada@x.org,"Submitted for grading - ",,50.00,Yes,'
    '"Monday, 2 March 2026, 10:00 AM",-,"<p>see ""page""</p>"\n'
    '"Participant 502","Bob O\'Neil",bob@x.org,"No submission - ",20.00,50.00,Yes,-,-,\n'
    '"Participant 503","Cleo Ünal",cleo@x.org,"Submitted for grading - ",,50.00,Yes,-,-,\n'
    '"Participant 504","Eve Eden",eve@x.org,"Submitted for grading - ",,50.00,No,-,-,\n'
)

BLACKBOARD = (
    '"Last Name"\t"First Name"\t"Username"\t"Student ID"\t"Last Access"\t"Availability"\t'
    '"Lab 3 [Total Pts: 100 Score] |123456"\t"Essay [Total Pts: 10 Letter] |123457"\t'
    '"Total [Total Pts: up to 110 Score] |123450"\r\n'
    '"Lovelace"\t"Ada"\t"alovelace"\t"s1001"\t"2026-03-02 10:00:00"\t"Yes"\t"Needs Grading"\t"A"\t"0"\r\n'
    '"O\'Neil"\t"Bob ""Bo"""\t"boneil"\t"s1002"\t""\t"Yes"\t"40"\t""\t"40"\r\n'
    '"Ünal"\t"Cleo"\t"cunal"\t"s1003"\t""\t"Yes"\t""\t""\t""\r\n'
    '"Eden"\t"Eve"\t"eeden"\t"s1004"\t""\t"No"\t"In Progress"\t""\t""\r\n'
)

BRIGHTSPACE = (
    "OrgDefinedId,Username,Last Name,First Name,Email,"
    "Lab 3 Points Grade <Numeric MaxPoints:20 Weight:10 Category:Labs CategoryWeight:30>,"
    "Mood Text Grade <Text>,Calculated Final Grade Numerator,End-of-Line Indicator\r\n"
    "#s1001,#alovelace,Lovelace,Ada,ada@x.org,,fine,12,#\r\n"
    "#s1002,#boneil,O'Neil,Bob,bob@x.org,8,,11,#\r\n"
    "#s1003,#cunal,Ünal,Cleo,cleo@x.org,,,,#\r\n"
    '#s3000,#other,Other,"Ann, or An",ann@x.org,,,,#\r\n'
)

#: Platform → its file's bytes.
FILES = {
    "Canvas": codecs.BOM_UTF8 + CANVAS.encode(),
    "Moodle": MOODLE.encode(),
    "Moodle's grading worksheet": WORKSHEET.encode(),
    "Blackboard": codecs.BOM_UTF16_LE + BLACKBOARD.encode("utf-16-le"),
    "Brightspace": BRIGHTSPACE.encode(),
}


def class_of_four(folder: Path) -> Path:
    """A gradebook: ada has 2.5 of 3 points, bob 1.2, of cleo an explanation waits, eve has handed nothing in."""
    path = folder / "gradebook.sqlite"
    (folder / "roster.csv").write_text(ROSTER, encoding="utf-8")
    with Gradebook(path) as book:
        book.import_roster(folder / "roster.csv")
        record(
            book,
            graded("s1001", mark(), prose()),
            graded("s1002", mark("partly right", points=1.2), prose("wrong", 0.0)),
            graded("s1003", mark(), prose()),
        )
        book.set_mark("s1001", "2.11", "explanation", 0.5, reason="Half of it.", actor="anna")
    return path
