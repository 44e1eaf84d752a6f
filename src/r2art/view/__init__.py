"""The viewer: photos in the browser, posed parts in 3D; see docs/viewer.md.

>>> from r2art.view.server import Viewer
>>> viewer = Viewer(r2art.load())
>>> viewer.url
'http://127.0.0.1:8080'
"""

HOST, PORT = "127.0.0.1", 8080
MAX_MEGABYTES = 25.0
"""Of a photo's file."""
