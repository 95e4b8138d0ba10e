"""The league: recordings of others, judged by `compass calibrate` against answers that were written down before."""
