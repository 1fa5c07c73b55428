// SPDX-License-Identifier: Apache-2.0
#include "alidade/report/column_pool.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "alidade/config/config.h"

namespace alidade::internal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string Bytes(const std::string& base64) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned group = 0;
  int bits = 0;
  for (const char digit : base64) {
    if (digit == '=') break;
    group = group << 6U | static_cast<unsigned>(digits.find(digit));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> static_cast<unsigned>(bits) & 0xFFU);
  }
  return bytes;
}

template <class Value>
std::vector<Value> ValuesOf(const Node& column) {
  const std::string bytes = Bytes(column.At("b").Text());
  std::vector<Value> values(bytes.size() / sizeof(Value));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Value));
  EXPECT_EQ(column.At("n").Number(), static_cast<double>(values.size()));
  return values;
}

/// Pool whose columns can be read.
struct ReadablePool : ColumnPool {
  Config Columns() const { return Config::FromText("columns: " + Text(), "pool"); }
};

TEST(ColumnPool, EqualColumnsAreStoredOnce) {
  ReadablePool pool;
  const std::vector<double> values = {1.0, 2.0, kNan}, others = {1.0, 2.0, 4.0};
  EXPECT_EQ(pool.AddNumbers(values), 0);
  EXPECT_EQ(pool.AddNumbers(others), 1);
  EXPECT_EQ(pool.AddNumbers(values), 0);
  EXPECT_EQ(pool.Columns().root().At("columns").Items().size(), 2u);
}

TEST(ColumnPool, NumbersAreFloats) {
  ReadablePool pool;
  const std::vector<double> values = {0.1, -2.5, kNan, kInfinity, 1e300};
  pool.AddNumbers(values);
  const Config columns = pool.Columns();
  const Node column = columns.root().At("columns").Items().at(0);
  EXPECT_EQ(column.At("d").Text(), "f4");
  const std::vector<float> floats = ValuesOf<float>(column);
  EXPECT_EQ(floats[0], 0.1F);
  EXPECT_EQ(floats[1], -2.5F);
  EXPECT_TRUE(std::isnan(floats[2]));
  EXPECT_EQ(floats[3], static_cast<float>(kInfinity));
  EXPECT_EQ(floats[4], static_cast<float>(kInfinity));  // beyond the range of a float
}

// A float has 24 bits, so at 1e6 m its step is 0.06 m. An offset preserves the differences.
TEST(ColumnPool, NumbersFarFromZeroHaveAnOffset) {
  ReadablePool pool;
  std::vector<double> values;
  for (int i = 0; i < 10; ++i) values.push_back(1e6 + 1e-4 * i);
  pool.AddNumbers(values);
  const Config columns = pool.Columns();
  const Node column = columns.root().At("columns").Items().at(0);
  const std::vector<float> floats = ValuesOf<float>(column);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = column.At("o").Number() + static_cast<double>(floats[i]);
    EXPECT_NEAR(value, values[i], 1e-9) << i;
  }
}

TEST(ColumnPool, EqualNumbersAreOneNumber) {
  ReadablePool pool;
  pool.AddNumbers(std::vector<double>{0.25, 0.25, 0.25});
  pool.AddNumbers(std::vector<double>{kNan, kNan});
  EXPECT_EQ(pool.Text(), R"([{"d":"const","n":3,"v":0.25},{"d":"const","n":2,"v":null}])");
}

TEST(ColumnPool, CloudsHave16Bits) {
  ReadablePool pool;
  const std::vector<double> values = {-3.2, 1.6, kNan};
  pool.AddCloud(values);
  const Config columns = pool.Columns();
  const Node column = columns.root().At("columns").Items().at(0);
  const std::vector<std::int16_t> numbers = ValuesOf<std::int16_t>(column);
  const double step = column.At("s").Number();
  EXPECT_NEAR(step, 3.2 / 32000.0, 1e-15);
  EXPECT_NEAR(step * numbers[0], -3.2, step);
  EXPECT_NEAR(step * numbers[1], 1.6, step);
  EXPECT_EQ(numbers[2], -32768);
}

TEST(ColumnPool, WholeNumbersHaveTheirWidth) {
  ReadablePool pool;
  pool.AddIntegers(std::vector<std::uint32_t>{1, 2, 3});
  pool.AddIntegers(std::vector<std::uint32_t>{0, 256});
  pool.AddIntegers(std::vector<std::uint32_t>{0, 70000});
  EXPECT_EQ(pool.Text(), R"([{"d":"u1","n":3,"b":"AQID"},{"d":"u2","n":2,"b":"AAAAAQ=="},)"
                         R"({"d":"u4","n":2,"b":"AAAAAHARAQA="}])");
}

TEST(ColumnPool, RegularTimesAreALine) {
  ReadablePool pool;
  pool.AddTimes(std::vector<Timestamp>{500'000'000, 750'000'000, 1'000'000'000}, 0);
  pool.AddTimes(std::vector<Timestamp>{0, 1, 5'000'000'000}, 0);
  const Config columns = pool.Columns();
  const auto items = columns.root().At("columns").Items();
  EXPECT_EQ(items[0].At("d").Text(), "lin");
  EXPECT_EQ(items[0].At("v").Number(), 0.5);
  EXPECT_EQ(items[0].At("s").Number(), 0.25);
  EXPECT_EQ(ValuesOf<double>(items[1]), (std::vector<double>{0.0, 1e-9, 5.0}));
}

TEST(ColumnPool, LongSeriesHave16Bits) {
  ReadablePool pool;
  std::vector<double> values = {0.0, kNan, kInfinity, -kInfinity, 1e-9, -1e9, 2.5};
  EXPECT_EQ(pool.AddSeries(values), pool.AddNumbers(values));  // a short series
  values.resize(ColumnPool::kLongSeries + 1, -0.125);
  const int index = pool.AddSeries(values);
  const Config columns = pool.Columns();
  const Node column = columns.root().At("columns").Items().at(static_cast<std::size_t>(index));
  EXPECT_EQ(column.At("d").Text(), "l2");
  const std::vector<std::uint16_t> codes = ValuesOf<std::uint16_t>(column);
  EXPECT_EQ(codes[0], 0);
  EXPECT_EQ(codes[1], 32767);
  EXPECT_EQ(codes[2], 32766);
  EXPECT_EQ(codes[3], 32766 | 0x8000);
  for (std::size_t i = 4; i < values.size(); i += 1000) {
    const double level = codes[i] & 0x7FFF;
    const double magnitude =
        std::exp2(column.At("v").Number() + column.At("s").Number() * (level - 1.0));
    EXPECT_NEAR(magnitude, std::abs(values[i]), 1e-3 * std::abs(values[i])) << i;
    EXPECT_EQ((codes[i] & 0x8000) != 0, values[i] < 0.0) << i;
  }
}

}  // namespace
}  // namespace alidade::internal
