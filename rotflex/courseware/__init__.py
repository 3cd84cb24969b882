"""What any course needs: one rule for students' IDs, files written whole, and messages that can be translated."""
