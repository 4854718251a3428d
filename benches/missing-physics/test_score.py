"""Tests of the score by cases small enough to count by hand: `python3 -m unittest`, without any package."""

import unittest

from score import brier, calibration_error, figures, judged, table


def truth(id, hidden="", effects=None, stages="", shown=""):
    return {"id": id, "hidden": hidden, "effects": hidden if effects is None else effects, "stages": stages, "shown": shown}


def said(id, verdict, probability, effects="", stage="", confidence="", before="", after=""):
    return {
        "id": id, "verdict": verdict, "effects": effects, "stage": stage, "probability": str(probability),
        "confidence": confidence, "rms_before_um": before, "rms_after_um": after, "seconds": "",
    }


TRUTHS = [
    truth("1", "creep", stages="memory", shown="yes"),
    truth("2", "radiation", stages="heat", shown="no"),
    truth("3", "stiction", effects="", stages="memory"),
    truth("4", "creep film-tcr", stages="memory resistance", shown="no"),
    truth("5"),
    truth("6"),
]


def of(*predictions):
    return figures(judged(TRUTHS, list(predictions)))


class Score(unittest.TestCase):
    def test_a_set_of_two_is_found_and_one_of_three_is_not(self):
        found = "found: named, or in a set of two"
        self.assertEqual(of(said("1", "named", 1, "hysteresis creep"))[found], "50 % (1 of 2)")
        self.assertEqual(of(said("1", "named", 1, "hysteresis softening creep"))[found], "0 % (0 of 2)")
        self.assertEqual(of(said("1", "named", 1, "creep"))["found, of what can be shown"], "100 % (1 of 1)")

    def test_a_wrong_name_is_one_without_any_truth(self):
        wrong = "a wrong name, anything hidden"
        self.assertEqual(of(said("1", "named", 1, "radiation"))[wrong], "25 % (1 of 4)")
        self.assertEqual(of(said("3", "named", 1, "creep"))[wrong], "25 % (1 of 4)")
        self.assertEqual(of(said("4", "named", 1, "film-tcr radiation"))[wrong], "0 % (0 of 4)")
        self.assertEqual(of(said("3", "unknown", 1))[wrong], "0 % (0 of 4)")

    def test_false_alarms_are_counted_where_nothing_is_hidden(self):
        alarm = of(said("5", "unknown", 0.9), said("6", "none", 0.1))
        self.assertEqual(alarm["nothing hidden: said to be missing"], "50 % (1 of 2)")
        self.assertEqual(alarm["anything hidden: said to be missing"], "0 % (0 of 4)")

    def test_who_cannot_name_is_heard_on_the_stage(self):
        stage = of(said("3", "unknown", 1, stage="memory"), said("1", "unknown", 1, stage="heat"))
        self.assertEqual(stage["right stage, one effect hidden"], "33 % (1 of 3)")
        self.assertEqual(stage["not in the list: `unknown`"], "100 % (1 of 1)")

    def test_no_answer_is_none_at_a_half(self):
        silent = of()
        self.assertEqual(silent["answered"], "0 % (0 of 6)")
        self.assertEqual(silent["Brier score of anything missing"], "0.25")

    def test_a_brier_score_is_a_mean_square(self):
        self.assertAlmostEqual(brier([(1.0, True), (0.5, False), (0.0, True)]), (0 + 0.25 + 1) / 3)
        self.assertIsNone(brier([]))

    def test_calibration_compares_each_bin_with_its_frequency(self):
        # Two of four come true at 0.9: off by 0.4. One of one at 0.1 does not: off by 0.1.
        pairs = [(0.9, True), (0.9, True), (0.9, False), (0.9, False), (0.1, False)]
        self.assertAlmostEqual(calibration_error(pairs), (4 * 0.4 + 0.1) / 5)
        self.assertAlmostEqual(calibration_error([(1.0, True)]), 0.0)

    def test_errors_are_medians_of_ratios(self):
        ratios = of(
            said("1", "named", 1, "creep", before="1.0", after="0.1"),
            said("2", "none", 0, before="0.5", after="0.5"),
            said("3", "unknown", 1, before="2", after="1"),
            said("5", "unknown", 1, before="0.2", after="0.4"),
        )
        self.assertEqual(ratios["error after over before, anything hidden"], "0.50")
        self.assertEqual(ratios["the same, nothing hidden"], "2.00")

    def test_what_cannot_be_judged_is_refused(self):
        for prediction in [
            said("7", "none", 0.1), said("1", "perhaps", 0.1), said("1", "named", 0.1), said("1", "none", 1.1)
        ]:
            with self.assertRaises(ValueError):
                of(prediction)
        with self.assertRaises(ValueError):
            of(said("1", "none", 0.1), said("1", "none", 0.1))

    def test_a_table_has_a_column_for_each_method(self):
        lines = table({"one": of(), "other": of(said("1", "named", 1, "creep"))}).splitlines()
        self.assertEqual(lines[0], "| figure | one | other |")
        self.assertIn("| found: named, or in a set of two | 0 % (0 of 2) | 50 % (1 of 2) |", lines)


if __name__ == "__main__":
    unittest.main()
