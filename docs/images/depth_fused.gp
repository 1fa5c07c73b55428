# Draws depth_fused.png from a run of examples/05_depth_principled/compare.yaml:
#   gnuplot -e "run='runs/demo'" docs/images/depth_fused.gp
set terminal pngcairo size 1200,520 font "DejaVu Sans,13"
set output run . "/depth_fused.png"
set datafile separator ","
set datafile columnheaders
set style fill transparent solid 0.25 noborder
set border 3 lc rgb "#555555"
set tics nomirror out
set grid lc rgb "#e6e6e6"
set key outside right top Left reverse samplen 2
set xlabel "t [s]"
set ylabel "depth [m]"
set xrange [0:5]
set yrange [0.1:0.5]
ekf = run . "/ekf/estimates.csv"
set label "stereo is blind\nbelow 0.3 m" at 1.55,0.33 tc rgb "#555555"
set arrow from 0,0.3 to 5,0.3 nohead dt 3 lc rgb "#555555"
plot ekf every ::2 using 1:($2-3*$3):($2+3*$3) with filledcurves lc rgb "#0072b2" title "stereo + scale: 3 sigma", \
     run . "/measurements.csv" using 1:(strcol(2) eq "disparity" ? 26.0/$4 : NaN) with points pt 7 ps 0.6 lc rgb "#e69f00" title "stereo, each frame", \
     run . "/stereo_only/estimates.csv" using 1:2 with lines lw 2 lc rgb "#d55e00" title "EKF, stereo only", \
     run . "/truth.csv" using 1:2 with lines lw 2 dt 2 lc rgb "#000000" title "truth", \
     ekf using 1:2 with lines lw 2 lc rgb "#0072b2" title "EKF, stereo + scale"
