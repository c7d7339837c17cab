"""A program is written, run and watched in a page of a browser, with nothing installed.

It stands on the panel, whose page and protocol it shares, and on the labs. Python runs in a worker of the page, as
WebAssembly. Begin with :mod:`elib.studio.worker`; ``page/src/studio`` is the page.
"""
