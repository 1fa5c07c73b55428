# Draws inverse_depth.png, the geometry of a landmark of inverse depth:
#   gnuplot docs/images/inverse_depth.gp
set terminal pngcairo enhanced size 1200,800 font "DejaVu Sans,14"
set output "docs/images/inverse_depth.png"

# A point (x right, y down, z ahead) on the paper.
px(x, y, z) = 0.80 * x + 0.78 * z
py(x, y, z) = -0.34 * x - y + 0.30 * z

# The anchor a, where the camera was at first; direction (theta, phi); inverse depth rho +- sigma.
ax = 0.2; ay = -0.75; az = 0.75
theta = 0.62; phi = 0.50; rho = 1 / 3.2; sigma = 0.035
mx = cos(phi) * sin(theta); my = -sin(phi); mz = cos(phi) * cos(theta)
X(d) = ax + d * mx; Y(d) = ay + d * my; Z(d) = az + d * mz
rayx(d) = px(X(d), Y(d), Z(d)); rayy(d) = py(X(d), Y(d), Z(d))
# The camera then, and at present at r; each is turned by `yaw` about the vertical, then up by `pitch`.
yaw0 = 0.30; pitch0 = 0.25; rx = 2.9; ry = -0.10; rz = 0.85; yaw1 = -0.25; pitch1 = 0.45
ppx = rayx(1 / rho); ppy = rayy(1 / rho)
rpx = px(rx, ry, rz); rpy = py(rx, ry, rz); apx = px(ax, ay, az); apy = py(ax, ay, az)

first = "#0072b2"; present = "#d55e00"; grey = "#555555"
unset border; unset tics; unset key
set margins 0, 0, 0, 0
set xrange [-1.05:5.95]
set yrange [-1.25:3.4167]

# A camera: the pyramid from its centre to an image of half width w and half height h, f ahead.
w = 0.36; h = 0.25; f = 0.55
camx(x, yaw, pitch, u, v, d) = x + u * cos(yaw) + v * sin(pitch) * sin(yaw) + d * cos(pitch) * sin(yaw)
camy(y, yaw, pitch, u, v, d) = y + v * cos(pitch) - d * sin(pitch)
camz(z, yaw, pitch, u, v, d) = z - u * sin(yaw) + v * sin(pitch) * cos(yaw) + d * cos(pitch) * cos(yaw)
su(i) = (i % 4 == 0 || i % 4 == 3) ? -w : w
sv(i) = (i % 4 < 2) ? -h : h
do for [c = 0:1] {
  x0 = c ? rx : ax; y0 = c ? ry : ay; z0 = c ? rz : az
  yaw = c ? yaw1 : yaw0; pitch = c ? pitch1 : pitch0; colour = c ? present : first
  do for [i = 0:3] {
    x1 = camx(x0, yaw, pitch, su(i), sv(i), f); x2 = camx(x0, yaw, pitch, su(i + 1), sv(i + 1), f)
    y1 = camy(y0, yaw, pitch, su(i), sv(i), f); y2 = camy(y0, yaw, pitch, su(i + 1), sv(i + 1), f)
    z1 = camz(z0, yaw, pitch, su(i), sv(i), f); z2 = camz(z0, yaw, pitch, su(i + 1), sv(i + 1), f)
    set arrow from px(x0, y0, z0), py(x0, y0, z0) to px(x1, y1, z1), py(x1, y1, z1) nohead lw 1.5 lc rgb colour
    set arrow from px(x1, y1, z1), py(x1, y1, z1) to px(x2, y2, z2), py(x2, y2, z2) nohead lw 1.5 lc rgb colour
  }
}
# Where its image has the point: the ray from (x, y, z) to p, as far as the image.
ahead(x, y, z, yaw, pitch) = (X(1 / rho) - x) * cos(pitch) * sin(yaw) - (Y(1 / rho) - y) * sin(pitch) + (Z(1 / rho) - z) * cos(pitch) * cos(yaw)
part0 = f / ahead(ax, ay, az, yaw0, pitch0); part1 = f / ahead(rx, ry, rz, yaw1, pitch1)
u0x = apx + part0 * (ppx - apx); u0y = apy + part0 * (ppy - apy)
u1x = rpx + part1 * (ppx - rpx); u1y = rpy + part1 * (ppy - rpy)

# World axes.
set arrow from 0, 0 to px(0.75, 0, 0), py(0.75, 0, 0) lw 2 lc rgb "black"
set arrow from 0, 0 to px(0, 0.65, 0), py(0, 0.65, 0) lw 2 lc rgb "black"
set arrow from 0, 0 to px(0, 0, 0.75), py(0, 0, 0.75) lw 2 lc rgb "black"
set label "x" at px(0.75, 0, 0) + 0.06, py(0.75, 0, 0) - 0.03
set label "y" at 0.07, py(0, 0.65, 0) + 0.02
set label "z" at px(0, 0, 0.75) + 0.06, py(0, 0, 0.75) + 0.02
set label "world" at -0.08, 0 right

# Vectors to the two cameras.
set arrow from 0, 0 to apx, apy lw 2 dt 2 lc rgb first
set label "a = (x_0, y_0, z_0)" at 0.24, 0.62 right tc rgb first
set arrow from 0, 0 to rpx, rpy lw 2 dt 2 lc rgb present
set label "r" at 0.6 * rpx, 0.6 * rpy - 0.13 tc rgb present
set label "camera at the\nfirst observation" at apx - 0.1, apy + 0.24 right tc rgb first
set label "camera at present,\norientation q" at rpx - 0.05, rpy - 0.26 center tc rgb present

# Angles of the ray: theta on the horizontal plane through a, from z towards x; phi from there up.
l = 2.1
set arrow from apx, apy to px(ax, ay, az + l), py(ax, ay, az + l) nohead lw 1.5 dt 3 lc rgb grey
set arrow from apx, apy to px(ax + l * sin(theta), ay, az + l * cos(theta)), py(ax + l * sin(theta), ay, az + l * cos(theta)) nohead lw 1.5 dt 3 lc rgb grey
set label "∥ z" at px(ax, ay, az + l) + 0.04, py(ax, ay, az + l) + 0.02 tc rgb grey
set label "θ" at px(ax + 1.75 * sin(0.5 * theta), ay, az + 1.75 * cos(0.5 * theta)), py(ax + 1.75 * sin(0.5 * theta), ay, az + 1.75 * cos(0.5 * theta)) tc rgb grey
g = 2.0
set label "φ" at px(ax + g * cos(0.55 * phi) * sin(theta), ay - g * sin(0.55 * phi), az + g * cos(0.55 * phi) * cos(theta)), py(ax + g * cos(0.55 * phi) * sin(theta), ay - g * sin(0.55 * phi), az + g * cos(0.55 * phi) * cos(theta)) tc rgb grey

# The ray: unit vector m, the point p at 1 / rho, and where it is with rho +- 2 sigma.
near = 1 / (rho + 2 * sigma); far = 1 / (rho - 2 * sigma)
set arrow from rayx(near), rayy(near) to rayx(far), rayy(far) nohead lw 12 lc rgb "#b3d4ea" back
set arrow from apx, apy to rayx(far) , rayy(far) nohead lw 1.5 lc rgb first
set arrow from apx, apy to rayx(1), rayy(1) lw 4 lc rgb first
set label "m(θ, φ)" at rayx(0.75) - 0.05, rayy(0.75) + 0.22 center tc rgb first
s = sqrt((ppx - apx)**2 + (ppy - apy)**2); nx = -(ppy - apy) / s; ny = (ppx - apx) / s; o = 0.66
set arrow from apx + o * nx, apy + o * ny to ppx + o * nx, ppy + o * ny heads lw 1.5 lc rgb first
set arrow from apx + 0.45 * nx, apy + 0.45 * ny to apx + 0.72 * nx, apy + 0.72 * ny nohead lc rgb first
set arrow from ppx + 0.1 * nx, ppy + 0.1 * ny to ppx + 0.72 * nx, ppy + 0.72 * ny nohead lc rgb first
set label "1/ρ" at 0.5 * (apx + ppx) + (o + 0.14) * nx, 0.5 * (apy + ppy) + (o + 0.14) * ny center tc rgb first
set label "point p = a + m/ρ" at ppx + 0.16, ppy - 0.13
set label "1/(ρ + 2σ)" at rayx(near) + 0.17 * nx, rayy(near) + 0.17 * ny right tc rgb first
set label "1/(ρ − 2σ)" at rayx(far) + 0.08, rayy(far) - 0.06 tc rgb first

# The ray at present, and the parallax.
set arrow from rpx, rpy to ppx, ppy nohead lw 1.5 lc rgb present
set label "h_W = p − r" at 0.5 * (rpx + ppx) + 0.10, 0.5 * (rpy + ppy) tc rgb present
to_a = atan2(apy - ppy, apx - ppx); to_r = atan2(rpy - ppy, rpx - ppx)
if (to_a > 0) { to_a = to_a - 2 * pi }
if (to_r > 0) { to_r = to_r - 2 * pi }
set label "parallax" at ppx + 0.78 * cos(0.5 * (to_a + to_r)), ppy + 0.78 * sin(0.5 * (to_a + to_r)) center tc rgb grey
set label "(u, v)" at u1x + 0.25, u1y + 0.12 tc rgb present
set label "h_C = R_{CW} (ρ (a − r) + m)\n(u, v) = K(h_C)" at 4.15, -0.25 tc rgb present

plot \
  sample [t = 0:1] "+" using (px(ax + 1.5 * sin(theta * t), ay, az + 1.5 * cos(theta * t))):(py(ax + 1.5 * sin(theta * t), ay, az + 1.5 * cos(theta * t))) with lines lw 2 lc rgb grey, \
  [t = 0:1] "+" using (px(ax + 1.8 * cos(phi * t) * sin(theta), ay - 1.8 * sin(phi * t), az + 1.8 * cos(phi * t) * cos(theta))):(py(ax + 1.8 * cos(phi * t) * sin(theta), ay - 1.8 * sin(phi * t), az + 1.8 * cos(phi * t) * cos(theta))) with lines lw 2 lc rgb grey, \
  [t = 0:1] "+" using (ppx + 0.5 * cos(to_a + (to_r - to_a) * t)):(ppy + 0.5 * sin(to_a + (to_r - to_a) * t)) with lines lw 2 lc rgb grey, \
  "+" using (u0x):(u0y) with points pt 7 ps 1.2 lc rgb first, \
  "+" using (u1x):(u1y) with points pt 7 ps 1.2 lc rgb present, \
  "+" using (ppx):(ppy) with points pt 7 ps 2 lc rgb "black"
