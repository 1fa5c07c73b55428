// SPDX-License-Identifier: Apache-2.0
//
// Tests what a stream reads from a row: units, covariances, ids, conditions, geodetic positions.
#include <cmath>
#include <map>
#include <numbers>

#include "alidade/io/log.h"
#include "plugins/tables/data_unit.h"
#include "tables_fixture.h"

namespace alidade::testing {
namespace {

using Text = std::vector<std::string>;

TEST(DataUnit, HasTheFactorsOfTheStandards) {
  const auto factor = [](const char* unit) {
    return ParseDataUnit(unit).value_or(DataUnit{-1.0, {}}).factor;
  };
  EXPECT_DOUBLE_EQ(factor("deg"), std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(factor("deg/s"), std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(factor("g"), 9.80665);
  EXPECT_DOUBLE_EQ(factor("mg"), 9.80665e-3);
  EXPECT_DOUBLE_EQ(factor("km/h"), 1.0 / 3.6);
  EXPECT_DOUBLE_EQ(factor("ft"), 0.3048);
  EXPECT_DOUBLE_EQ(factor("nmi"), 1852.0);
  EXPECT_DOUBLE_EQ(factor("kn"), 1852.0 / 3600.0);
  EXPECT_DOUBLE_EQ(factor("nmi/h"), factor("kn"));
  EXPECT_DOUBLE_EQ(factor("mph"), 0.44704);
  EXPECT_DOUBLE_EQ(factor("rpm"), std::numbers::pi / 30.0);
  EXPECT_DOUBLE_EQ(factor("mm/s^2"), 1e-3);
  EXPECT_DOUBLE_EQ(factor("hPa"), 100.0);
  EXPECT_DOUBLE_EQ(factor("gauss"), 100.0) << "uT, as sensor magnetometer";
  for (const char* unit : {"", "furlong", "m/", "/s", "m s", "DEGREE"}) {
    EXPECT_FALSE(ParseDataUnit(unit)) << unit;
  }
}

TEST(DataUnit, HasTheDimensionsOfItsFactors) {
  const auto dimensions = [](const char* unit) { return ParseDataUnit(unit)->dimensions; };
  using Dimensions = std::map<std::string, int>;
  EXPECT_EQ(dimensions("km/h"), (Dimensions{{"m", 1}, {"s", -1}}));
  EXPECT_EQ(dimensions("kn"), dimensions("m/s"));
  EXPECT_EQ(dimensions("g"), (Dimensions{{"m", 1}, {"s", -2}}));
  EXPECT_EQ(dimensions("mm/s/s"), dimensions("m/s^2"));
  EXPECT_EQ(dimensions("m/g"), (Dimensions{{"s", 2}}));
  EXPECT_EQ(dimensions("rpm"), dimensions("deg/s"));
  EXPECT_EQ(dimensions("gauss"), dimensions("uT"));
  EXPECT_EQ(dimensions("percent"), Dimensions{});
  EXPECT_NE(dimensions("deg"), dimensions("deg/s"));
}

TEST_F(Tables, RejectsAUnitOfAnotherDimension) {
  Write("t_s,v,w\n0,90,36\n");
  const auto check = [&](const std::string& keys, const Text& units) {
    Open("path: a.csv\nstreams: {other: v, drive: {columns: [v, w], " + keys + "}}\n")
        ->CheckUnits(1, units, "sensor 's'");
  };
  const std::string expected =
      "the unit of sensor 's'; expected a unit of the same dimension, or a gain that converts the "
      "dimension";
  ExpectError(ExitCode::kBadConfig,
              "run.yaml:2:52 streams.drive.unit: 'deg' cannot be converted to m/s, " + expected,
              [&] {
                check("unit: deg", {"m/s", "rad"});
              });
  ExpectError(ExitCode::kBadConfig,
              "run.yaml:2:57 streams.drive.unit[1]: 'm/s' cannot be converted to rad, " + expected,
              [&] {
                check("unit: [kn, m/s]", {"m/s", "rad"});
              });
  check("unit: [km/h, deg], gain: -1", {"m/s", "rad"});
  check("unit: [rpm, deg], gain: [0.3, 1]", {"m/s", "rad"});  // the gain is the radius of a wheel
  check("unit: deg", {"", "rad"});
  check("unit: deg, reciprocal: true", {"m", "m"});
  check("unit: deg, geodetic: true", {"m", "m"});
  check("gain: 2", {"m/s", "rad"});
}

TEST_F(Tables, ConvertsUnitsGainsAndOffsets) {
  // A compass heading of 90 deg, clockwise from north, is the direction 0, anticlockwise from east.
  Write("t_s,compass,v,ax,ay\n0,90,36,1,2\n");
  const auto frames = Frames(
      "path: a.csv\nstreams:\n"
      "  heading: {columns: compass, unit: deg, gain: -1, offset: 90deg}\n"
      "  speed: {columns: v, unit: km/h}\n"
      "  imu: {columns: [ax, ay, compass], unit: [g, mg, deg], gain: [1, -1, 2], offset: "
      "[1, 1m/s^2, 90]}\n");
  EXPECT_NEAR(frames[0].measurements[0].values[0], 0.0, 1e-15);
  EXPECT_DOUBLE_EQ(frames[0].measurements[1].values[0], 10.0);
  EXPECT_DOUBLE_EQ(frames[0].measurements[2].values[0], 2.0 * 9.80665);
  EXPECT_DOUBLE_EQ(frames[0].measurements[2].values[1], 1.0 - 2e-3 * 9.80665);
  EXPECT_DOUBLE_EQ(frames[0].measurements[2].values[2], 1.5 * std::numbers::pi);
  ExpectBadConfig("path: a.csv\nstreams: {v: {columns: v, unit: kmh}}\n",
                  "run.yaml:2:33 streams.v.unit: 'kmh' is not a unit; expected a unit such as deg, "
                  "deg/s, km/h, ft or mm/s^2, or one of " +
                      std::string(kDataUnits));
  ExpectBadConfig("path: a.csv\nstreams: {a: {columns: [ax, ay], gain: [1, 2, 3]}}\n",
                  "run.yaml:2:40 streams.a.gain: a list of 3; expected one value, or 2, one for "
                  "each column");
}

TEST_F(Tables, AnOffsetIsInTheUnitOfItsColumn) {
  const std::string heading = "path: a.csv\nstreams: {h: {columns: h, unit: deg, gain: -1, ";
  Write("t_s,h\n0,30\n");
  const double expected = std::numbers::pi / 3.0;
  EXPECT_DOUBLE_EQ(Frames(heading + "offset: 90}}\n")[0].measurements[0].values[0], expected);
  EXPECT_DOUBLE_EQ(Frames(heading + "offset: 90deg}}\n")[0].measurements[0].values[0], expected);
  // The offset of a reciprocal does not have the unit of the column.
  EXPECT_DOUBLE_EQ(Frames("path: a.csv\nstreams: {h: {columns: h, unit: km, reciprocal: true, "
                          "offset: 2}}\n")[0]
                       .measurements[0]
                       .values[0],
                   2.0 + 1.0 / 30e3);
}

TEST_F(Tables, TruthHasUnitsToo) {
  Write("t_s,h\n0,180\n");
  const auto frames =
      Frames("path: a.csv\nstreams: {h: h}\ntruth: {heading: {columns: h, unit: deg}}\n");
  EXPECT_DOUBLE_EQ(frames[0].truth[0][0], std::numbers::pi);
  ExpectBadConfig("path: a.csv\nstreams: {h: h}\ntruth: {heading: {columns: h, sigma: h}}\n",
                  "run.yaml:3:31 truth.heading.sigma: unknown key; expected one of columns, gain, "
                  "geodetic, offset, reciprocal, rows, unit, valid");
}

// ---- covariances --------------------------------------------------------------------------------

/// Returns the covariances of the first stream.
std::vector<std::vector<double>> Covariances(const std::vector<SourceFrame>& frames) {
  std::vector<std::vector<double>> covariances;
  for (const SourceFrame& frame : frames) {
    for (const Measurement& m : frame.measurements) covariances.push_back(m.covariance);
  }
  return covariances;
}
using Matrices = std::vector<std::vector<double>>;

TEST_F(Tables, ReadsTheCovarianceOfEachMeasurement) {
  Write("t_s,x,y,s,sx,sy,vx,xy\n0,1,2,3,2,4,25,-1\n1,1,2,,5,6,7,8\n");
  const auto covariances = [&](const std::string& keys) {
    return Covariances(Frames("path: a.csv\nstreams: {z: {columns: [x, y], " + keys + "}}\n"));
  };
  EXPECT_EQ(covariances("sigma: [sx, sy]"), (Matrices{{4, 0, 0, 16}, {25, 0, 0, 36}}));
  // A missing sigma: the measurement has the noise of its sensor.
  EXPECT_EQ(covariances("sigma: s"), (Matrices{{9, 0, 0, 9}, {}}));
  EXPECT_EQ(covariances("variance: [vx, sy]"), (Matrices{{25, 0, 0, 4}, {7, 0, 0, 6}}));
  EXPECT_EQ(covariances("covariance: [vx, xy, sy]"), (Matrices{{25, -1, -1, 4}, {7, 8, 8, 6}}));
  EXPECT_EQ(covariances("covariance: [vx, xy, xy, sy]")[0], (std::vector<double>{25, -1, -1, 4}));
  // A gain scales the standard deviations, whatever its sign.
  EXPECT_EQ(covariances("gain: -2, sigma: [sx, sy]")[0], (std::vector<double>{16, 0, 0, 64}));
  EXPECT_EQ(covariances("gain: [2, 3], covariance: [vx, xy, sy]")[0],
            (std::vector<double>{100, -6, -6, 36}));
  EXPECT_EQ(covariances("unit: cm, variance: [vx, sy]")[0][0], 25 * 0.01 * 0.01);
}

TEST_F(Tables, RefusesWhatIsNoCovariance) {
  Write("t_s,x,y,s\n0,1,2,-3\n");
  const auto config = [](const std::string& keys) {
    return "path: a.csv\nstreams: {z: {columns: [x, y], " + keys + "}}\n";
  };
  ExpectError(ExitCode::kBadData, "FILE:2:7 s: '-3' is negative; expected 0 or more",
              [&] { Frames(config("sigma: s")); });
  ExpectBadConfig(config("sigma: s, variance: s"),
                  "run.yaml:2:52 streams.z.variance: the covariance is given twice; expected one "
                  "of sigma, variance and covariance");
  ExpectBadConfig(config("covariance: [s, s]"),
                  "run.yaml:2:44 streams.z.covariance: 2 columns are not a covariance; expected "
                  "n^2 columns, or the n (n + 1) / 2 columns of the upper triangle, row by row");
  ExpectBadConfig(config("gain: [1, 2], covariance: s"),
                  "run.yaml:2:58 streams.z.covariance: the columns of the values have different "
                  "units or gains; expected 2 standard deviations, one for each column");
  ExpectBadConfig(config("reciprocal: true, sigma: s"),
                  "run.yaml:2:57 streams.z.sigma: the values are reciprocals; expected "
                  "'reciprocal: false'");
}

// ---- ids, conditions, constants -----------------------------------------------------------------

TEST_F(Tables, ReadsTheIdsOfLandmarks) {
  const std::string config =
      "path: a.csv\ntime: {column: t_s, repeats: true}\n"
      "streams: {sight: {columns: [r, b], landmark: id}}\n";
  const auto frames = Frames("t_s,id,r,b\n0,7,1,2\n0,12,3,4\n1,,5,6\n", config);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].measurements[0].landmark, 7);
  EXPECT_EQ(frames[0].measurements[1].landmark, 12);
  EXPECT_EQ(frames[1].measurements[0].landmark, -1);
  for (const std::string id : {"-1", "1.5", "1e17"}) {
    ExpectBadData("t_s,id,r,b\n0," + id + ",1,2\n",
                  "FILE:2:3 id: '" + id +
                      "' is not the id of a landmark; expected a whole number of 0 or more",
                  config);
  }
}

TEST_F(Tables, ConditionsSelectRows) {
  Write("t_s,beacon,kind,r\n0,1,a,10\n1,2,b,20\n2,3,b,30\n3,1.0,c,40\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {one: {columns: r, rows: {beacon: 1}}, b: "
                         "{columns: r, rows: {kind: [a, b], beacon: [2, 1]}}}\n")),
            (Text{"0 s0=10 s1=10", "1000 s1=20", "3000 s0=40"}));
}

// A row that nothing selects is not a frame, but its time must be in order.
TEST_F(Tables, RowsThatNothingSelectsAreNotFrames) {
  Write("t_s,beacon,r\n0,1,10\n1,2,x\n2,1,30\n");
  EXPECT_EQ(Timestamps(Frames("path: a.csv\nstreams: {one: {columns: r, rows: {beacon: 1}}}\n")),
            (std::vector<Timestamp>{0, 2'000'000'000}));
}

TEST_F(Tables, AnInvalidRowHasNoMeasurement) {
  Write("t_s,r,ok\n0,1,1\n1,2,0\n2,3,true\n3,4,False\n4,5,\n5,6,4\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {r: {columns: r, valid: ok}}\n")),
            (Text{"0 s0=1", "1000", "2000 s0=3", "3000", "4000", "5000 s0=6"}));
  ExpectBadData("t_s,r,ok\n0,1,maybe\n",
                "FILE:2:5 ok: 'maybe' is neither a number nor true or false; expected 0 or false: "
                "not valid",
                "path: a.csv\nstreams: {r: {columns: r, valid: ok}}\n");
}

TEST_F(Tables, AConstantIsMeasuredInEachRow) {
  Write("t_s,still\n0,1\n1,0\n2,1\n");
  EXPECT_EQ(Shown(Frames("path: a.csv\nstreams: {zero: {constant: [0, 0], rows: {still: 1}}, one: "
                         "{constant: 1, valid: still}}\n")),
            (Text{"0 s0=0,0 s1=1", "1000", "2000 s0=0,0 s1=1"}));
  ExpectBadConfig("path: a.csv\nstreams: {z: {constant: 0, columns: still}}\n",
                  "run.yaml:2:37 streams.z.columns: 'columns' and 'constant' are both given; "
                  "expected only one of these keys");
  ExpectBadConfig(
      "path: a.csv\nstreams: {z: {constant: 0, unit: deg}}\n",
      "run.yaml:2:28 streams.z.unit: unknown key; expected one of columns, constant, "
      "covariance, delay_s, known, landmark, min_interval_s, rows, sigma, valid, variance");
}

// ---- geodetic positions -------------------------------------------------------------------------

/// Returns east, north and up by the closed formulas of the ellipsoid, not by GeographicLib.
std::array<double, 3> Enu(double latitude, double longitude, double height, double latitude0,
                          double longitude0, double height0) {
  constexpr double a = 6378137.0, f = 1.0 / 298.257223563, e2 = f * (2.0 - f);
  constexpr double kDegree = std::numbers::pi / 180.0;
  const auto ecef = [&](double lat, double lon, double h) {
    const double s = std::sin(lat), n = a / std::sqrt(1.0 - e2 * s * s);
    return std::array<double, 3>{(n + h) * std::cos(lat) * std::cos(lon),
                                 (n + h) * std::cos(lat) * std::sin(lon), (n * (1.0 - e2) + h) * s};
  };
  const double p = latitude0 * kDegree, l = longitude0 * kDegree;
  const auto x = ecef(latitude * kDegree, longitude * kDegree, height), x0 = ecef(p, l, height0);
  const double dx = x[0] - x0[0], dy = x[1] - x0[1], dz = x[2] - x0[2];
  return {-std::sin(l) * dx + std::cos(l) * dy,
          -std::sin(p) * std::cos(l) * dx - std::sin(p) * std::sin(l) * dy + std::cos(p) * dz,
          std::cos(p) * std::cos(l) * dx + std::cos(p) * std::sin(l) * dy + std::sin(p) * dz};
}

constexpr const char* kFixes =
    "t_s,lat,lon,h\n0,48.137,11.575,520\n1,48.1379,11.5731,523\n2,48.2,11.7,900\n";

TEST_F(Tables, GeodeticPositionsAreEastNorthUpOfTheFirst) {
  const auto frames =
      Frames(kFixes, "path: a.csv\nstreams: {gps: {columns: [lat, lon, h], geodetic: true}}\n");
  ASSERT_EQ(frames.size(), 3u);
  const double fixes[3][3] = {{48.137, 11.575, 520}, {48.1379, 11.5731, 523}, {48.2, 11.7, 900}};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto expected = Enu(fixes[k][0], fixes[k][1], fixes[k][2], 48.137, 11.575, 520);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(frames[k].measurements[0].values[i], expected[i], 1e-6) << k << i;
    }
  }
}

TEST_F(Tables, AnOriginMayBeGiven) {
  const auto frames =
      Frames(kFixes,
             "path: a.csv\norigin: {latitude_deg: 48, longitude_deg: 11.5, height_m: 500}\n"
             "streams: {gps: {columns: [lat, lon], geodetic: true}}\n"
             "truth: {position: {columns: [lat, lon, h], geodetic: true}}\n");
  const auto expected = Enu(48.1379, 11.5731, 0.0, 48.0, 11.5, 500.0);
  ASSERT_EQ(frames[1].measurements[0].values.size(), 2u);
  EXPECT_NEAR(frames[1].measurements[0].values[0], expected[0], 1e-6);
  EXPECT_NEAR(frames[1].measurements[0].values[1], expected[1], 1e-6);
  EXPECT_NEAR(frames[1].truth[0][2], Enu(48.1379, 11.5731, 523.0, 48.0, 11.5, 500.0)[2], 1e-6);
}

TEST_F(Tables, AFirstPositionFarFromTheOriginIsAWarning) {
  Write(kFixes);
  const auto warnings = [&](const std::string& latitude_deg, const std::string& longitude_deg) {
    std::vector<std::string> texts;
    const LogSubscription log(LogLevel::kWarning,
                              [&](LogLevel, std::string_view text) { texts.emplace_back(text); });
    Frames("path: a.csv\norigin: {latitude_deg: " + latitude_deg + ", longitude_deg: " +
           longitude_deg + "}\nstreams: {gps: {columns: [lat, lon], geodetic: true}}\n");
    return texts;
  };
  EXPECT_EQ(warnings("48.9", "11.5").size(), 0u) << "85 km";
  EXPECT_EQ(warnings("49.1", "11.5").size(), 1u) << "107 km";
  // On a sphere of 6371 km, the angle between the positions is 47.6 deg, and the chord 5140 km.
  EXPECT_EQ(warnings("11.575", "48.137"),
            Text{"the first geodetic position is 5135 km from `origin`; are latitude and longitude "
                 "exchanged, in the columns or in `origin`?"});
}

TEST_F(Tables, AGainScalesGeodeticDegrees) {
  Write("t_s,lat,lon,s\n0,481370000,115750000,2\n1,481379000,115731000,3\n");
  const auto frames = Frames(
      "path: a.csv\nstreams: {gps: {columns: [lat, lon], geodetic: true, gain: 1e-7, sigma: s}}\n");
  EXPECT_NEAR(frames[1].measurements[0].values[0], Enu(48.1379, 11.5731, 0, 48.137, 11.575, 0)[0],
              1e-6);
  EXPECT_EQ(frames[1].measurements[0].covariance, (std::vector<double>{9, 0, 0, 9}))
      << "sigma is in m";
}

TEST_F(Tables, RefusesOneUnitForAnglesAndHeight) {
  Write("t_s,lat,lon,h\n0,48,11,520\n");
  ExpectBadConfig(
      "path: a.csv\nstreams: {gps: {columns: [lat, lon, h], geodetic: true, unit: deg}}\n",
      "run.yaml:2:63 streams.gps.unit: one value would apply to the angles and to the height; "
      "expected a list with a value for each of latitude, longitude and height");
}

TEST_F(Tables, RefusesWhatIsNoPosition) {
  const std::string config = "path: a.csv\nstreams: {gps: {columns: [lat, lon], geodetic: true}}\n";
  ExpectBadData("t_s,lat,lon\n0,111.5,48\n",
                "FILE:2:3 lat: '111.5' is not a latitude; expected -90 to 90 deg, or the unit of "
                "the column, as in 'unit: [rad, rad, m]'",
                config);
  ExpectBadData("t_s,lat,lon\n0,48,400\n",
                "FILE:2:6 lon: '400' is not a longitude; expected -360 to 360 deg, or the unit of "
                "the column, as in 'unit: [rad, rad, m]'",
                config);
  ExpectBadConfig("path: a.csv\nstreams: {gps: {columns: lat, geodetic: true}}\n",
                  "run.yaml:2:41 streams.gps.geodetic: the position has 1 columns; expected "
                  "columns: latitude, longitude and perhaps height");
}

}  // namespace
}  // namespace alidade::testing
