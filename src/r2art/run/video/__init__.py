"""One object followed through a clip: photos with times in, a smooth state with deviations out.

`track` is the whole flow; docs/video.md explains the filter.
"""

from r2art.run.video.frame import Frame, Tracked
from r2art.run.video.track import Tracker, track

__all__ = ["Frame", "Tracked", "Tracker", "track"]
