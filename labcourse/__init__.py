"""What any course needs: one rule for students' IDs, files written whole, kinds of answers, a student's session."""
