function answer = <<name>>(file)
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
legend({'\alpha_1', '\alpha_2', '\alpha_3', '\alpha_4'}, 'Location', 'northoutside', 'Orientation', 'horizontal');
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
rows = regexp(strtrim(text), '\n', 'split');
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
