% SPDX-License-Identifier: MIT
% Writes the .mat files of this folder: octave-cli make.m
s.time = (0:9)' / 2;
s.rate = repmat([8.5; 8.25; 8.125], 4, 1)(1:10);
s.note = 'x';
m = reshape(1:20, 10, 2);
row = int16(1:10);
n = 7;
save -v6 octave-v6.mat s m row n
save -v7 octave-v7.mat s m row n
