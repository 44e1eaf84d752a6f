"""A run's log and its curves."""

from r2art.learn.journal import CURVES, LOG, Journal, forget_after, plot_losses, read_log


def timeless(folder) -> list[dict]:
    return [{k: v for k, v in entry.items() if k != "seconds"} for entry in read_log(folder)]


def test_the_journal_writes_means_over_the_steps_that_had_the_loss(tmp_path):
    diary = Journal(tmp_path)
    diary.add({"total": 1.0})
    diary.add({"total": 3.0, "cascade": 5.0})
    assert diary.means() == {"total": 2.0, "cascade": 5.0}
    diary.write(2)
    diary.add({"total": 0.0})
    diary.write(4)
    first, second = timeless(tmp_path)
    assert first == {"step": 2, "total": 2.0, "cascade": 5.0}
    assert second == {"step": 4, "total": 0.0}
    plot_losses(tmp_path)  # a loss that is zero has no logarithm
    assert (tmp_path / CURVES).exists()
    forget_after(tmp_path, 3)
    assert timeless(tmp_path) == [first]
    forget_after(tmp_path, 0)
    assert (tmp_path / LOG).read_text() == ""
    (tmp_path / CURVES).unlink()
    plot_losses(tmp_path)
    assert not (tmp_path / CURVES).exists()
