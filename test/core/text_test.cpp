// SPDX-License-Identifier: MIT
#include "core/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/random.h"

namespace minescan {
namespace {

TEST(NumberText, ReadsBackToTheSameDouble) {
  Random random(1, 0);
  for (int i = 0; i < 1000; ++i) {
    const double value = random.normal() * std::pow(10.0, static_cast<double>(i % 40) - 20);
    EXPECT_EQ(parse_number(number_text(value)), value);
  }
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(parse_number(" +1e-3 "), 0.001);
}

TEST(ParseNumber, TakesNothingElse) {
  for (const char* text :
       {"", " ", "1.2.3", "1,2", "0x10", "nan", "inf", "-inf", "1e999", "1 m", "--1"})
    EXPECT_THROW(parse_number(text), std::invalid_argument) << text;
  for (const char* text : {"1.5", "1e17", "a"})
    EXPECT_THROW(parse_integer(text), std::invalid_argument) << text;
  EXPECT_EQ(parse_integer("1e6"), 1'000'000);
}

TEST(Split, DropsBlanksAndKeepsEmptyParts) {
  EXPECT_EQ(split(" a, b ,,c", ','), (std::vector<std::string>{"a", "b", "", "c"}));
  EXPECT_TRUE(split("  ", ',').empty());
  EXPECT_EQ(parse_numbers("1,2  3\n4"), (std::vector<double>{1, 2, 3, 4}));
}

TEST(TextHash, DependsOnEveryByte) {
  EXPECT_EQ(text_hash("a").size(), 16u);
  EXPECT_NE(text_hash("a"), text_hash("b"));
  EXPECT_NE(text_hash("ab"), text_hash("ba"));
  EXPECT_NE(text_hash(""), text_hash(std::string_view("\0", 1)));
}

}  // namespace
}  // namespace minescan
