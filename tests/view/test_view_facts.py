"""What the viewer writes beside the picture; it needs no viser."""

from dataclasses import replace

import numpy as np
import pytest

from r2art.view.facts import facts


@pytest.fixture
def prediction(predictor):
    return predictor.predict(np.full((60, 80, 3), 128, np.uint8))


def test_why_a_photo_is_rejected_is_said_once_and_never_as_markup(prediction):
    shown = facts(replace(prediction, rejected="<b>blank</b> & grey", warnings=()))
    assert shown.count("&lt;b&gt;blank&lt;/b&gt; &amp; grey") == 1
    assert shown.count("r2art-rejected") == 1
    assert "<b>blank" not in shown
    assert "r2art-rejected" not in facts(replace(prediction, rejected=None))
