"""SciPy and statsmodels judge the statistics."""

import subprocess
import unittest

import support
from support import PATIENCE, PROGRAMS

support.need_module("numpy", "scipy", "statsmodels")

import numpy as np  # noqa: E402
import scipy.stats  # noqa: E402
from scipy.special import gamma  # noqa: E402
from statsmodels.stats.diagnostic import normal_ad  # noqa: E402
from statsmodels.stats.proportion import proportion_confint  # noqa: E402
from statsmodels.tsa.stattools import acf  # noqa: E402

LOWER, UPPER = 2.44, 2.98
Z = scipy.stats.norm.ppf(0.975)


def statistics_of(values, breaks=()):
    """By name: the lists of values of each line."""
    done = subprocess.run([PROGRAMS / "spindle_peer_statistics_numbers", *map(str, breaks)], timeout=PATIENCE,
                          input="\n".join(map(repr, map(float, values))), capture_output=True, text=True, check=True)
    lines = {}
    for line in done.stdout.splitlines():
        name, *numbers = line.split()
        lines.setdefault(name, []).append([float(number) for number in numbers])
    return lines


def bounds(value, count, freedom):
    swing = Z * np.sqrt(1 / (9 * count) + value**2 / (2 * freedom))
    return [value, value - swing, value + swing]


def index(mean, deviation):
    return min(UPPER - mean, mean - LOWER) / (3 * deviation)


def runs(side, length):
    """How many runs of `length` or more there are of one side, in points of -1, 0 and 1."""
    pieces = np.split(side, np.flatnonzero(np.diff(side)) + 1)
    return sum(1 for piece in pieces if piece[0] != 0 and len(piece) >= length)


def crowded(beyond, window, least):
    """How many points are beyond and end a window in which `least` are, counted from the definition."""
    padded = np.concatenate([np.zeros(window - 1, dtype=int), beyond.astype(int)])
    sums = np.lib.stride_tricks.sliding_window_view(padded, window).sum(axis=1)
    return int((beyond & (sums >= least)).sum())


class Judged(unittest.TestCase):
    def assert_close(self, seen, wanted):
        np.testing.assert_allclose(seen, wanted, rtol=1e-9, atol=1e-12)

    def assert_moments(self, found, x):
        self.assert_close(found["moments"][0], [np.mean(x), np.std(x, ddof=1), scipy.stats.skew(x),
                                                scipy.stats.kurtosis(x), x.min(), x.max()])

    def assert_rules(self, found, pieces):
        """`pieces`: the points of each stretch without an interruption, in sigma from the centre."""
        count = sum(len(piece) for piece in pieces)
        seen = {int(rule): (signals, expected) for rule, signals, expected in found["rule"]}
        sides = (1, -1)
        self.assertEqual(seen[0][0], sum(int((abs(z) > 3).sum()) for z in pieces))
        self.assertEqual(seen[1][0], sum(runs(np.sign(z), 8) for z in pieces))
        self.assertEqual(seen[2][0], sum(crowded(s * z > 2, 3, 2) for z in pieces for s in sides))
        self.assertEqual(seen[3][0], sum(crowded(s * z > 1, 5, 4) for z in pieces for s in sides))
        two, one = scipy.stats.norm.sf([2, 1])
        self.assert_close([seen[rule][1] for rule in range(4)], [
            count / 370, count / 256,
            count * 2 * two * scipy.stats.binom.sf(0, 2, two), count * 2 * one * scipy.stats.binom.sf(2, 4, one)])

    def assert_classes(self, found, x):
        lowest, width = found["classes"][0]
        counts = found["counts"][0]
        edges = lowest + width * np.arange(len(counts) + 1)
        self.assertEqual(np.histogram(x, edges)[0].tolist(), counts)


class Many(Judged):
    """100,000 results as a tool rounds them: charted as subgroups."""

    @classmethod
    def setUpClass(cls):
        cls.x = np.round(np.random.default_rng(1).normal(2.71, 0.033, 100_000), 2)
        cls.found = statistics_of(cls.x)

    def test_moments(self):
        self.assert_moments(self.found, self.x)
        self.assert_close(self.found["autocorrelation"][0], acf(self.x, nlags=1, fft=False)[1:])

    def test_indices(self):
        x, n = self.x, len(self.x)
        s = np.std(x, ddof=1)
        self.assert_close(self.found["performance"][0],
                          [*bounds(index(x.mean(), s), n, n - 1), (UPPER - LOWER) / (6 * s)])
        self.assert_close(self.found["upper_performance"][0][:3], bounds((UPPER - x.mean()) / (3 * s), n, n - 1))
        mean_range = abs(np.diff(x)).mean()
        self.assert_close(self.found["ranges"][0], [mean_range, mean_range / 1.128])
        within = mean_range / 1.128
        self.assert_close(self.found["capability"][0],
                          [*bounds(index(x.mean(), within), n, 0.62 * (n - 1)), (UPPER - LOWER) / (6 * within)])

    def test_percentiles(self):
        low, median, high = np.quantile(self.x, [0.00135, 0.5, 0.99865])
        self.assert_close(self.found["percentile"][0],
                          [min((UPPER - median) / (high - median), (median - LOWER) / (median - low))])
        self.assertNotIn("normality", self.found)

    def test_chart(self):
        groups = self.x.reshape(-1, 5)
        means, deviations = groups.mean(axis=1), groups.std(axis=1, ddof=1)
        first, count = map(int, self.found["baseline"][0])
        self.assertEqual((first, count), (0, 25_000))
        centre, s = means[:count // 5].mean(), deviations[:count // 5].mean()
        c4 = np.sqrt(2 / 4) * gamma(5 / 2) / gamma(4 / 2)
        a3 = 3 / (c4 * np.sqrt(5))
        b4 = 1 + 3 / c4 * np.sqrt(1 - c4**2)
        self.assert_close(self.found["limits"][0], [centre, centre - a3 * s, centre + a3 * s])
        self.assert_close(self.found["spread"][0], [s, 0, b4 * s])
        self.assert_rules(self.found, [(means - centre) / (a3 * s / 3)])

    def test_histogram(self):
        self.assert_classes(self.found, self.x)

    def test_tables(self):
        for mean, quantile in self.found["poisson"]:
            self.assertEqual(quantile, scipy.stats.poisson.ppf(0.95, mean), mean)
        for ok, ng, low, high in self.found["yield"]:
            self.assert_close([low, high], proportion_confint(ok, ok + ng, method="wilson"))


class Interrupted(Judged):
    """2,000 results with interruptions: charted one by one."""

    BREAKS = (3, 500, 501, 1200)

    @classmethod
    def setUpClass(cls):
        cls.x = np.random.default_rng(2).gamma(20, 0.03, 2000) + 2.1
        cls.found = statistics_of(cls.x, cls.BREAKS)
        cls.pieces = np.split(cls.x, cls.BREAKS)

    def test_moments(self):
        self.assert_moments(self.found, self.x)

    def test_indices(self):
        ranges = np.concatenate([abs(np.diff(piece)) for piece in self.pieces])
        within = ranges.mean() / 1.128
        self.assert_close(self.found["ranges"][0], [ranges.mean(), within])
        self.assert_close(self.found["capability"][0][:3],
                          bounds(index(self.x.mean(), within), 2000, 0.62 * len(ranges)))

    def test_normality(self):
        statistic, probability = normal_ad(self.x)
        self.assert_close(self.found["normality"][0], [statistic, probability])

    def test_chart(self):
        first, count = map(int, self.found["baseline"][0])
        self.assertEqual((first, count), (0, 500))
        baseline = np.split(self.x[:500], [3])
        mean_range = np.concatenate([abs(np.diff(piece)) for piece in baseline]).mean()
        centre, sigma = self.x[:500].mean(), mean_range / 1.128
        self.assert_close(self.found["limits"][0], [centre, centre - 3 * sigma, centre + 3 * sigma])
        self.assert_close(self.found["spread"][0], [mean_range, 0, 3.267 * mean_range])
        self.assert_rules(self.found, [(piece - centre) / sigma for piece in self.pieces])

    def test_histogram(self):
        self.assert_classes(self.found, self.x)


if __name__ == "__main__":
    unittest.main(verbosity=2)
