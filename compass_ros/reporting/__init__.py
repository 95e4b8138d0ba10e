"""What a calibration found, for people and for programs: result.json, HTML report, terminal table, figures."""

from compass_ros.reporting.extras import Candidate, ReportExtras, ResidualMap, Scene, Shape
from compass_ros.reporting.report import write_report
from compass_ros.reporting.result_json import read_result, to_json, write_result
from compass_ros.reporting.table import print_result

__all__ = [
    "Candidate",
    "ReportExtras",
    "ResidualMap",
    "Scene",
    "Shape",
    "print_result",
    "read_result",
    "to_json",
    "write_report",
    "write_result",
]
