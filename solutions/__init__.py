"""What knows the answers: the notebooks with solutions, the key, and the checks that know this plant."""
