"""Read gait tables: CSV, Parquet and bags piece by piece, so that any length fits in memory, the others whole.

Whatever the format, names, numbers, texts and times are checked here.
"""

from __future__ import annotations

from gaitgraph.reading.columns import table_from_columns
from gaitgraph.reading.files import provenance_in, read_pieces, read_table

__all__ = ["provenance_in", "read_pieces", "read_table", "table_from_columns"]
