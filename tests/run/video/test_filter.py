"""Laws of the filter, on simulated measurements."""

from dataclasses import replace

import numpy as np
import pytest

from r2art.run.refinement.pose import rotation_of
from r2art.run.video.limits import deviation
from r2art.run.video.measure import WHITE
from r2art.run.video.motion import CALM, UNKNOWN, Agility, predicted
from r2art.run.video.state import Measurement, State
from r2art.run.video.update import begun, updated

DT = 1 / 30
SPANS = np.array([2.3, 0.4])  # a hinge (rad) and a slide (m)
LIMITS = np.array([[0.0, 2.3], [0.0, 0.4]])
WIDE = np.array([[-1e6, 1e6], [-1e6, 1e6]])
N = 8
PLACE = np.array([0.2, -0.1, 2.5])


def measure(rng, truth):
    """A measurement with exactly the noise it claims."""
    covariance = WHITE.covariance(truth.place, SPANS, np.ones(3))
    error = rng.multivariate_normal(np.zeros(N + 1), covariance)
    return Measurement(
        rotation=rotation_of(error[:3]) @ truth.rotation,
        place=truth.place + error[3:6],
        joints=truth.joints + error[6:N],
        log_size=truth.log_size + error[N],
        covariance=covariance,
    )


def still(joints=(1.0, 0.2)):
    """An object at rest."""
    return State(
        rotation=rotation_of(np.array([0.4, -0.9, 0.3])),
        place=PLACE,
        joints=np.array(joints),
        rates=np.zeros(N),
        log_size=np.log(0.4),
        covariance=np.zeros((2 * N + 1, 2 * N + 1)),
    )


def drive(factors=1.0):
    return CALM.of(float(np.linalg.norm(PLACE)), SPANS) ** 2 * factors


def start(measurement, limits=LIMITS):
    return begun(measurement, limits, UNKNOWN.of(float(np.linalg.norm(PLACE)), SPANS))


def filtered(measurements, limits=LIMITS, agile=True):
    """The beliefs after each measurement; None is a frame that says nothing."""
    state = start(measurements[0], limits)
    agility = Agility(np.zeros(N))
    yield state
    for measurement in measurements[1:]:
        state = predicted(state, DT, drive(agility.factors if agile else 1.0))
        update = updated(state, measurement, limits)
        state, agility = update.state, agility.after(update.whitened)
        yield state


def test_errors_are_as_large_as_the_filter_says():
    """Normalised estimation error squared: on average its degrees of freedom, over many runs."""
    rng = np.random.default_rng(0)
    nees = []
    for _ in range(16):
        truth = replace(still(), rates=rng.normal(0, UNKNOWN.of(2.5, SPANS)))
        measurements, truths = [], []
        for _ in range(30):
            noise = predicted(truth, DT, drive()).covariance
            truth = predicted(truth, DT, drive()).moved(
                rng.multivariate_normal(np.zeros(2 * N + 1), noise, check_valid="ignore")
            )
            truth = replace(truth, covariance=np.zeros_like(noise))
            truths.append(truth)
            measurements.append(measure(rng, truth))
        for k, state in enumerate(filtered(measurements, WIDE)):
            if k >= 10:
                error = truths[k].minus(state)
                nees.append(error @ np.linalg.solve(state.covariance, error))
    assert np.mean(nees) / (2 * N + 1) == pytest.approx(1, abs=0.2)


def test_a_still_object_is_known_better_and_better():
    rng = np.random.default_rng(1)
    truth = still()
    states = list(filtered([measure(rng, truth) for _ in range(60)]))
    first, last = np.diag(states[0].covariance), np.diag(states[-1].covariance)
    assert (last < first).all()
    # What does not change is averaged: the deviation of the size falls as 1 / √n.
    assert last[-1] == pytest.approx(first[-1] / 60, rel=0.15)
    assert states[-1].log_size == pytest.approx(truth.log_size, abs=4 * WHITE.size / 60**0.5)


@pytest.mark.parametrize("nonsense", [None, "nan"])
def test_frames_that_say_nothing_let_it_coast_with_growing_uncertainty(nonsense):
    rng = np.random.default_rng(2)
    measurements = [measure(rng, still()) for _ in range(20)]
    broken = replace(measurements[0], joints=np.full(2, np.nan)) if nonsense else None
    states = list(filtered([*measurements, *[broken] * 15]))
    variances = np.array([np.diag(s.covariance)[:N] for s in states[20:]])
    assert (np.diff(variances, axis=0) > 0).all()
    assert np.isfinite(variances).all()
    assert np.abs(states[-1].rates).max() < np.abs(states[19].rates).max()  # it comes to rest


def test_turning_and_moving_the_camera_frame_turns_and_moves_the_result():
    rng = np.random.default_rng(3)
    truth = replace(still(), rates=rng.normal(0, 0.3, N))
    measurements = []
    for k in range(25):
        truth = predicted(truth, DT, drive(0.0))
        m = measure(rng, truth)
        # One odd frame and one that says nothing, so that all branches are taken.
        odd = replace(m, rotation=rotation_of(np.array([0.3, 0, 0])) @ m.rotation)
        measurements.append(None if k == 12 else odd if k == 15 else m)
    Q, c = rotation_of(np.array([0.7, 0.2, -1.1])), np.array([0.3, -2.0, 0.5])
    turn = np.eye(N + 1)
    turn[:3, :3] = turn[3:6, 3:6] = Q

    def seen_from_there(m):
        return m and replace(
            m,
            rotation=Q @ m.rotation,
            place=Q @ m.place + c,
            covariance=turn @ m.covariance @ turn.T,
        )

    here = list(filtered(measurements))
    there = list(filtered([seen_from_there(m) for m in measurements]))
    for a, b in zip(here, there, strict=True):
        np.testing.assert_allclose(b.rotation, Q @ a.rotation, atol=1e-9)
        np.testing.assert_allclose(b.place, Q @ a.place + c, atol=1e-9)
        np.testing.assert_allclose(b.joints, a.joints, atol=1e-9)
        np.testing.assert_allclose(b.rates[:3], Q @ a.rates[:3], atol=1e-8)
        np.testing.assert_allclose(
            b.covariance[3:6, 3:6], Q @ a.covariance[3:6, 3:6] @ Q.T, atol=1e-12
        )


@pytest.mark.parametrize("joints", [(0.0, 0.4), (2.3, 0.0)])
def test_joints_never_leave_their_limits(joints):
    """Noise, and motion that runs on while nothing is seen, both push outwards."""
    rng = np.random.default_rng(4)
    rising = [measure(rng, still(0.5 + 0.1 * np.array([k, 0.2 * k]))) for k in range(10)]
    resting = [measure(rng, still(joints)) for _ in range(40)]
    for state in filtered([*rising, *[None] * 30, *resting]):
        assert (state.joints >= LIMITS[:, 0]).all()
        assert (state.joints <= LIMITS[:, 1]).all()
    np.testing.assert_allclose(state.joints, joints, atol=0.02)


def test_what_is_reported_of_a_joint_knows_the_limits():
    samples = np.random.default_rng(5).normal(0.1, 0.3, 400_000)
    kept = samples[(samples > 0) & (samples < 0.9)]
    expected = np.sqrt(np.mean((kept - 0.1) ** 2))
    assert deviation(0.1, 0.3, 0.0, 0.9) == pytest.approx(expected, rel=0.01)
    assert deviation(0.5, 1e6, 0.0, 1.0) == pytest.approx(1 / np.sqrt(12), rel=1e-3)
    assert deviation(0.5, 0.01, 0.0, 1.0) == pytest.approx(0.01, rel=1e-6)
    assert deviation(0.0, 0.0, 0.0, 0.0) == 0


def test_one_absurd_frame_changes_nothing_but_many_that_agree_do():
    rng = np.random.default_rng(6)
    calm = [measure(rng, still()) for _ in range(30)]
    absurd = measure(rng, still((2.2, 0.2)))
    *_, before = filtered(calm)
    *_, after = filtered([*calm, absurd])
    assert abs(after.joints[0] - before.joints[0]) < 0.02
    *_, convinced = filtered([*calm, *[measure(rng, still((2.2, 0.2))) for _ in range(20)]])
    assert convinced.joints[0] == pytest.approx(2.2, abs=0.1)


def test_noise_is_smoothed_and_motion_is_not_delayed():
    """A hinge opened within a second, as the benchmark has it."""
    rng = np.random.default_rng(7)
    t = np.clip((np.arange(60) - 12) / 36, 0, 1)
    angle = 0.3 + 1.4 * t**3 * (10 - 15 * t + 6 * t**2)
    measurements = [measure(rng, still((a, 0.2))) for a in angle]
    estimate = np.array([s.joints[0] for s in filtered(measurements)])
    raw = np.array([m.joints[0] for m in measurements])

    def jitter(x):
        return np.diff(x - angle, 2).std()

    assert jitter(raw) > 3 * jitter(estimate)
    lags = np.arange(-3, 6.1, 0.1)
    at = np.arange(60.0)
    late = [np.corrcoef(estimate, np.interp(at - lag, at, angle))[0, 1] for lag in lags]
    assert lags[int(np.argmax(late))] <= 2


def test_it_becomes_lively_where_things_move_abruptly_and_calm_again():
    rng = np.random.default_rng(8)
    lively = Agility(np.zeros(N))
    for _ in range(5):
        lively = lively.after(np.array([0] * 6 + [2.0, 0]))
    assert lively.factors[6] > 5
    np.testing.assert_array_equal(np.delete(lively.factors, 6), 1)
    chance = lively
    for _ in range(40):
        chance = chance.after(rng.normal(size=N))
    assert chance.factors[6] < 2
