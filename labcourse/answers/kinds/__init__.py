"""The kinds of answers. Each module has, for each of its kinds, three functions:

* ``encode_…(part, value) -> (content, hints)``: what a student gives, as plain data, and what is worth a second look;
  raises NotAnswered where there is nothing yet, and FormError (a hint) where it has another form;
* ``decode_…(part, content)``: the plain data of a file, strictly read, as a Python value; raises AnswerError;
* ``show_…(part, content)``: a few words for an acknowledgement.

Hints teach; none gives away the value, or the range in which it is expected.
"""
