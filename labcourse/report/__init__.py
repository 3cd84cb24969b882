"""A lab report as one document: put together from what a student recorded and wrote, as HTML and as PDF."""
