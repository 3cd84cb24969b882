"""The workbook: its questions, the form of their answers, and the book in which answers are kept."""
