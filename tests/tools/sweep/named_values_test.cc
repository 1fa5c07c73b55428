// SPDX-License-Identifier: Apache-2.0
#include "alidade/sweep/named_values.h"

#include <gtest/gtest.h>

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
  const NamedValues<double> first(Map{{"a", 1.0}, {"b", 2.0}});
  const NamedValues<double> second(Map{{"a", 3.0}, {"b", 4.0}}, first);
  EXPECT_EQ(&second.names(), &first.names());
  EXPECT_EQ(second.values(), (std::vector<double>{3.0, 4.0}));
  for (const Map& other : {Map{{"a", 3.0}}, Map{{"a", 3.0}, {"c", 4.0}},
                           Map{{"a", 3.0}, {"b", 4.0}, {"c", 5.0}}, Map{}}) {
    NamedValues<double> third(other, first);
    EXPECT_NE(&third.names(), &first.names());
    EXPECT_EQ(third.names().size(), other.size());
    EXPECT_FALSE(third.ShareNames(first));
    EXPECT_EQ(third.names().size(), other.size());
  }
  NamedValues<double> made_apart(Map{{"a", 5.0}, {"b", 6.0}});
  EXPECT_NE(&made_apart.names(), &first.names());
  EXPECT_TRUE(made_apart.ShareNames(first));
  EXPECT_EQ(&made_apart.names(), &first.names());
  EXPECT_EQ(made_apart.values(), (std::vector<double>{5.0, 6.0}));
}

}  // namespace
}  // namespace alidade
