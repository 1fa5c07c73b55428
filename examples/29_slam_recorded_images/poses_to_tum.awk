# Converts poses of 7-Scenes, which are files of 4 x 4 numbers (world_from_cam), to the TUM format:
#   awk -f poses_to_tum.awk frame-*.pose.txt > truth.tum
function root(s) { return s > 0 ? sqrt(s) / 2 : 0 }
function sign(s) { return s < 0 ? -1 : 1 }
{ for (i = 1; i <= 4; ++i) m[FNR, i] = $i }
FNR == 4 {
  printf "%.9f %s %s %s ", frame / 30, m[1, 4], m[2, 4], m[3, 4]
  printf "%.9f ", sign(m[3, 2] - m[2, 3]) * root(1 + m[1, 1] - m[2, 2] - m[3, 3])
  printf "%.9f ", sign(m[1, 3] - m[3, 1]) * root(1 - m[1, 1] + m[2, 2] - m[3, 3])
  printf "%.9f ", sign(m[2, 1] - m[1, 2]) * root(1 - m[1, 1] - m[2, 2] + m[3, 3])
  printf "%.9f\n", root(1 + m[1, 1] + m[2, 2] + m[3, 3])
  ++frame
}
