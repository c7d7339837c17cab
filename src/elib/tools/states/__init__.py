"""State machines in the text of a program: ``text`` reads them, ``edits`` changes them, ``drawing`` draws them."""
