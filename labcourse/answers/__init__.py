"""A student's answers: their kinds and forms, the catalogue of what is asked, and the files that keep them."""
