// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/named_values.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace alidade {
namespace {

using Map = std::map<std::string, double>;

TEST(NamedValues, AreThoseOfTheMap) {
  const NamedValues<double> row(Map{{"b", 2.0}, {"a", 1.0}, {"d", 4.0}});
  EXPECT_EQ(row.names(), (std::vector<std::string>{"a", "b", "d"}));
  EXPECT_EQ(row.values(), (std::vector<double>{1.0, 2.0, 4.0}));
  ASSERT_NE(row.Find("b"), nullptr);
  EXPECT_EQ(*row.Find("b"), 2.0);
  for (const char* other : {"", "aa", "c", "e"}) EXPECT_EQ(row.Find(other), nullptr) << other;
  EXPECT_TRUE(NamedValues<double>().names().empty());
  EXPECT_EQ(NamedValues<double>().Find("a"), nullptr);
}

TEST(NamedValues, ShareTheNamesThatAreTheSame) {
  SharedNames shared;
  NamedValues<double> first(Map{{"a", 1.0}, {"b", 2.0}});
  first.ShareNames(shared);
  EXPECT_EQ(first.names(), (std::vector<std::string>{"a", "b"}));
  for (const Map& other : {Map{{"a", 3.0}}, Map{{"a", 3.0}, {"c", 4.0}},
                           Map{{"a", 3.0}, {"b", 4.0}, {"c", 5.0}}, Map{}}) {
    NamedValues<double> row(other);
    const std::vector<std::string> names = row.names();
    row.ShareNames(shared);
    EXPECT_NE(&row.names(), &first.names());
    EXPECT_EQ(row.names(), names);
  }
  NamedValues<std::int64_t> same(std::map<std::string, std::int64_t>{{"a", 5}, {"b", 6}});
  EXPECT_NE(&same.names(), &first.names());
  same.ShareNames(shared);
  EXPECT_EQ(&same.names(), &first.names());
  EXPECT_EQ(same.values(), (std::vector<std::int64_t>{5, 6}));
}

}  // namespace
}  // namespace alidade
