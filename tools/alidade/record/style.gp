# SPDX-License-Identifier: Apache-2.0
set datafile separator comma
set datafile columnheaders
set encoding utf8
set samples 2
set border 3 lc rgb '#555555'
set tics nomirror textcolor rgb '#333333'
set grid lc rgb '#e4e4e4' lt 1
set key at graph 1.01, graph 1.08 left top Left reverse samplen 2 font ',11' noenhanced
set lmargin 11
set tmargin 2
set bmargin 1.5
set style fill solid 0.22 noborder
set style line 1 lw 1.5 lc rgb '#0072b2'
set style line 2 lw 1.5 lc rgb '#d55e00'
set style line 3 lw 1.5 lc rgb '#009e73'
set style line 4 lw 1.5 lc rgb '#cc79a7'
set style line 5 lw 1.5 lc rgb '#e69f00'
set style line 6 lw 1.5 lc rgb '#56b4e9'
set style line 7 lw 1.5 lc rgb '#8c6d31'
set style line 8 lw 1.5 lc rgb '#7570b3'
set style line 11 lw 1.2 lc rgb '#111111' dt 2
set style line 12 lw 1.0 lc rgb '#888888'
set style line 13 pt 7 ps 0.35 lc rgb '#d9822b'
set style line 14 pt 7 ps 0.35 lc rgb '#4a8db7'
set style line 15 pt 7 ps 0.35 lc rgb '#5aa469'
set style line 16 pt 2 ps 0.5 lc rgb '#c03030'
set style line 17 pt 8 ps 0.6 lc rgb '#c03030'
set style line 18 pt 6 ps 0.8 lc rgb '#111111'
set style line 19 pt 0 lw 0.8 lc rgb '#a5c6db'
set style line 20 pt 7 ps 0.5 lc rgb '#b294d0'
set style line 21 pt 6 ps 0.8 lw 0.7 lc rgb '#aaaaaa'
max(a, b) = a > b ? a : b
min(a, b) = a < b ? a : b
# Returns the length by which a range is widened at each end. It is never zero.
margin(low, high) = high > low ? max(0.08 * (high - low), 1e-6 * max(abs(low), abs(high))) : \
                    low == 0 ? 1 : 0.1 * abs(low)
# Returns the number nearest to x that is 1, 2 or 5 times a power of ten.
tic_step(x) = (power = 10**floor(log10(x)), \
               x < 1.5 * power ? power : x < 3.5 * power ? 2 * power : \
               x < 7.5 * power ? 5 * power : 10 * power)
# Functions for a line through the rows of a file for which `mine` is true: along() returns x, and
# level() returns y. The line is interrupted between rows that are more than `gap` apart.
along(mine, t) = (row = mine, jump = mine && t - px > gap, px = mine ? t : px)
level(value) = (py = jump ? NaN : row ? value : py)
before = 0  # value of an angle in the previous row
