__import__("labcourse.kernels", fromlist=["watch"]).watch()
