% Plot a recording of rotflex, in Octave or MATLAB.
%
%   plot_recording('sweep.mat')
%
% The three axes show, over the time in seconds, the servo's angle (with the command, or with the model's angle in a
% validation), the deflection, both in degrees, and the motor's voltage. Returns the figure.
% A second argument 'off' keeps the window from opening.
function shown = plot_recording(file, visible)
  if nargin < 2
    visible = 'on';
  end
  log = load(file);
  shown = figure('visible', visible);
  subplot(3, 1, 1);
  plot(log.data_theta(:, 1), log.data_theta(:, 2:end));
  ylabel('theta (deg)');
  title(file, 'interpreter', 'none');
  subplot(3, 1, 2);
  plot(log.data_alpha(:, 1), log.data_alpha(:, 2:end));
  ylabel('alpha (deg)');
  subplot(3, 1, 3);
  plot(log.data_vm(:, 1), log.data_vm(:, 2));
  ylabel('V_m (V)');
  xlabel('t (s)');
end
