"""What any course needs: kinds and forms of answers, the file that they are kept in, a student's session, explorers."""
