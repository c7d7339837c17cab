"""The panel over HTTP: the page's files, its login, and one WebSocket for each page; the only part that knows HTTP.

Begin with ``http.py`` (the server), then ``page.py`` (one open page), ``messages.py`` (what it may ask for) and
``instruments.py`` (what it is told). ``access.py`` decides who may use it.
"""
