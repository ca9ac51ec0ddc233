"""A function for MATLAB and Octave (.m) that loads and plots the gait file beside it.

It needs no toolbox and no Python, and reads the .mat, .csv or .json file of its own name.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from gaitgraph.errors import InputError, shown
from gaitgraph.files import text_of
from gaitgraph.gait.table import provenance_text
from gaitgraph.io.mat import is_matlab_name

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from gaitgraph.gait.table import Table

__all__ = ["provenance_of_m", "write_m"]

_MADE_BY = "% made by: "
_END = "% end"

_TEXT = """function answer = <<name>>(file)
%<<name>>  Load the gait of this name, and plot it.
%   <<name>> plots the tilt angles, rates and accelerations in <<name>>.mat, or else
%   in <<name>>.csv or <<name>>.json, beside this file.
%   gait = <<name>> returns a struct instead: t (s), alpha (rad, one column for each
%   rotor), alpha_rate (rad/s), alpha_acceleration (rad/s^2), and R.
%   <<name>>(FILE) takes another .mat, .csv or .json file.
%   timeseries(gait.alpha, gait.t) is for Simulink; so is [gait.t gait.alpha].
<<made by>>
if nargin < 1
    folder = fileparts(mfilename('fullpath'));
    file = '';
    for suffix = {'.mat', '.csv', '.json'}
        candidate = fullfile(folder, [mfilename() suffix{1}]);
        if isempty(file) && exist(candidate, 'file')
            file = candidate;
        end
    end
    if isempty(file)
        error('<<name>>:none', 'no %s.mat, .csv or .json beside %s.m', mfilename(), mfilename());
    end
end
[~, ~, suffix] = fileparts(file);
switch lower(suffix)
    case '.mat'
        columns = load(file);
    case '.csv'
        columns = columns_of_csv(file);
    case '.json'
        content = jsondecode(text_of(file));
        columns = content.columns;
    otherwise
        error('<<name>>:suffix', '%s: allowed are .mat, .csv and .json', file);
end
if isfield(columns, 'gait')
    columns = columns.gait;
end
for kind = {'', '_rate', '_acceleration'}
    names = strcat({'alpha1', 'alpha2', 'alpha3', 'alpha4'}, kind{1});
    if all(isfield(columns, names))
        columns.(['alpha' kind{1}]) = [columns.(names{1})(:), columns.(names{2})(:), ...
            columns.(names{3})(:), columns.(names{4})(:)];
        columns = rmfield(columns, names);
    end
end
if nargout > 0
    answer = columns;
    return
end
kinds = {'alpha', 'alpha_rate', 'alpha_acceleration'};
labels = {'tilt angle (rad)', 'tilt rate (rad/s)', 'tilt acceleration (rad/s^2)'};
kinds_there = isfield(columns, kinds);
if ~kinds_there(1)
    error('<<name>>:columns', 'no alpha1 to alpha4 in %s', file);
end
kinds = kinds(kinds_there);
labels = labels(kinds_there);
time = (0:size(columns.alpha, 1) - 1)';
time_label = 'row';
if isfield(columns, 't')
    time = columns.t(:);
    time_label = 't (s)';
end
figure('Name', '<<name>>');
styles = {'-', '-', '--', '--'};
for k = 1:numel(kinds)
    subplot(numel(kinds), 1, k);
    lines = plot(time, columns.(kinds{k}));
    for rotor = 1:4
        set(lines(rotor), 'LineStyle', styles{rotor}, 'LineWidth', 1.5);
    end
    grid on;
    ylabel(labels{k});
    if time(end) > time(1)
        xlim([time(1) time(end)]);
    end
end
xlabel(time_label);
subplot(numel(kinds), 1, 1);
legend({'\\alpha_1', '\\alpha_2', '\\alpha_3', '\\alpha_4'}, 'Location', 'northoutside', 'Orientation', 'horizontal');
end

function text = text_of(file)
stream = fopen(file, 'r');
if stream < 0
    error('<<name>>:file', 'cannot read %s', file);
end
text = fread(stream, [1 Inf], '*char');
fclose(stream);
end

function columns = columns_of_csv(file)
text = strrep(text_of(file), char(13), '');
text = regexprep(text, '"([^"]|"")*"', '');
rows = regexp(strtrim(text), '\\n', 'split');
names = regexp(rows{1}, ',', 'split');
cells = regexp(rows(2:end), ',', 'split');
cells = vertcat(cells{:});
columns = struct();
for k = 1:numel(names)
    values = str2double(cells(:, k));
    if ~any(isnan(values))
        columns.(names{k}) = values;
    end
end
end
% end
"""

_NOT_NAMES = re.compile(r"^%.*|(?<![\w)\]}.'])'(?:[^'\n]|'')*'|<<[\w ]+>>", re.MULTILINE)
_USED = frozenset(re.findall(r"(?<![\w.])[A-Za-z]\w*", _NOT_NAMES.sub(" ", _TEXT))) | {"alpha"}
"""What the function calls, and its variables: in a file of such a name it would call itself."""


def write_m(pieces: Iterable[Table], path: Path) -> None:
    """Write a new MATLAB function: it loads and plots the .mat, .csv or .json file of its own name.

    Raises
    ------
    InputError
        If the file's name is none that MATLAB can call, or one that the function itself calls.
    """
    name = path.stem
    if not is_matlab_name(name):
        raise InputError(
            f"output: {shown(path.name)}; allowed for a MATLAB function are letters, digits and _, a letter first, and "
            "no word of MATLAB's own"
        )
    if name in _USED:
        raise InputError(
            f"output: {shown(path.name)}: {name} is a function that the script calls, or a variable of it; allowed is "
            "another name"
        )
    table = next(iter(pieces))
    text = _TEXT.replace("<<name>>", name).replace("<<made by>>", _MADE_BY + provenance_text(table))
    path.write_text(text, encoding="ascii")


def provenance_of_m(path: Path) -> str:
    """Return the text of what made a MATLAB function that :func:`write_m` wrote.

    Raises
    ------
    FileProblem, InputError
        If it cannot be read, does not tell, or was cut off.
    """
    allowed = "a MATLAB function that gaitgraph wrote"
    lines = text_of(path, "gait file", allowed).rstrip().splitlines()
    told = next((line for line in lines if line.startswith(_MADE_BY)), None)
    if told is None:
        raise InputError(f"it has no line {_MADE_BY.strip()!r}; allowed is {allowed}")
    if lines[-1].rstrip() != _END:
        raise InputError(f"it ends early: its last line is not {_END!r}; allowed is {allowed}, all of it")
    return told.removeprefix(_MADE_BY)
