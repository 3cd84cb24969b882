__import__("labcourse.restarted", fromlist=["watch"]).watch()
