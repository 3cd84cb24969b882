"""The bounds of answers: how much is stored of one, and how much is read."""

FORMAT = 2  #: of answers.json
MAX_INTEGER = 10**20  #: what is typed with 15 digits, in millionths
LONGEST_PROSE = 5000  #: characters; two pages
LONGEST_SENTENCE = 1000  #: characters on a prediction: a sentence, and a few more
LONGEST_LABEL = 200  #: characters: two lines
LONGEST_METADATA = 4000  #: characters of JSON; what a bench says of itself, ten times
MOST_AXES = 8  #: diagrams of a figure: four rows of two
MOST_LINES = 24  #: curves and marks of one diagram, twice the dozen curves that a reader can distinguish
CURVE_POINTS = 200  #: that are stored of a curve
RECORDING_POINTS = 400  #: that are stored of a channel: as many as a plot is wide, halved
MOST_SAMPLES = 10**7  #: of a recording: more than an hour at 2 kHz
