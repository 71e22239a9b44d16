// SPDX-License-Identifier: MIT
#include "core/fields.h"

#include <gtest/gtest.h>

#include "core/config.h"

namespace minescan {
namespace {

enum class Colour { red, green };
constexpr auto names_of(Colour) { return std::to_array<std::string_view>({"red", "green"}); }

struct Inner {
  double size = 0.5;
};
template <class Visitor>
void fields(Inner& o, Visitor&& field) {
  field("size", o.size, positive, "m", "how large");
}

struct Outer {
  Inner inner = {};
  int count = 3;
  std::uint64_t seed = 1;
  bool fast = false;
  Colour colour = Colour::red;
  std::string title = {};
  std::vector<double> levels = {1, 2.5};
  std::vector<Eigen::Vector3d> line = {{0, 0, 0}, {1, -2, 0.5}};
};
template <class Visitor>
void fields(Outer& o, Visitor&& field) {
  fields(o.inner, field);
  field("count", o.count, between(1, 10), "", "how many");
  field("seed", o.seed, not_negative, "", "names the random choice");
  field("fast", o.fast, "whether to hurry");
  field("colour", o.colour, "of the thing");
  field("title", o.title, "of the page");
  field("levels", o.levels, not_negative, "m", "the steps");
  field("line", o.line, between(-10, 10), "m", "the way");
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Fields, ListsDefaultsAndTakesSettings) {
  const std::vector<Field> list = fields_of(Outer{});
  ASSERT_EQ(list.size(), 8u);
  EXPECT_EQ(list[0].name, "size");
  EXPECT_EQ(list[0].unit, "m");
  EXPECT_EQ(list[0].expected, "a number > 0");
  EXPECT_EQ(list[4].expected, "red | green");
  EXPECT_EQ(list[6].value, "1, 2.5");

  const Outer o = with_settings(Outer{}, {{"size", "2"},
                                          {"count", "1e1"},
                                          {"fast", "true"},
                                          {"colour", "green"},
                                          {"levels", "0,1, 3"}});
  EXPECT_EQ(o.inner.size, 2);
  EXPECT_EQ(o.count, 10);
  EXPECT_TRUE(o.fast);
  EXPECT_EQ(o.colour, Colour::green);
  EXPECT_EQ(o.levels, (std::vector<double>{0, 1, 3}));
}

// Writing every field and reading it back changes nothing.
TEST(Fields, ValuesReadBack) {
  const std::vector<Field> list = fields_of(Outer{});
  Settings all;
  for (const Field& field : list) all[field.name] = field.value;
  all["size"] = "0.1";
  const std::vector<Field> again = fields_of(with_settings(Outer{}, all));
  for (const Field& field : again) EXPECT_EQ(field.value, all[field.name]) << field.name;
}

TEST(Fields, SayWhatWasExpected) {
  const auto set = [](const char* name, const char* text) {
    return message_of([&] { with_settings(Outer{}, {{name, text}}); });
  };
  EXPECT_EQ(set("size", "-1"), "size = '-1': expected a number > 0, found '-1'");
  EXPECT_EQ(set("size", "nan"), "size = 'nan': expected a number > 0, found 'nan'");
  EXPECT_EQ(set("size", "1 m"), "size = '1 m': expected a number > 0, found '1 m'");
  EXPECT_EQ(set("count", "2.5"), "count = '2.5': expected a whole number in [1, 10], found '2.5'");
  EXPECT_EQ(set("count", "1e9"), "count = '1e9': expected a whole number in [1, 10], found '1e9'");
  EXPECT_EQ(set("colour", "blue"), "colour = 'blue': expected red | green, found 'blue'");
  EXPECT_EQ(set("siez", "1"),
            "unknown key 'siez'; known: size, count, seed, fast, colour, title, levels, line");
}

TEST(Fields, ReadPointsOfTwoOrThreeNumbers) {
  EXPECT_EQ(find_field(fields_of(Outer{}), "line")->value, "0 0 0, 1 -2 0.5");
  const Outer set = with_settings(Outer{}, {{"line", "1 2,  3  4 -5 "}});
  EXPECT_EQ(set.line, (std::vector<Eigen::Vector3d>{{1, 2, 0}, {3, 4, -5}}));
  for (const char* wrong : {"1", "1 2 3 4", "1 2, x 3", "1 11", "1 nan"})
    EXPECT_THROW(with_settings(Outer{}, {{"line", wrong}}), std::invalid_argument) << wrong;
}

TEST(Config, NestsAndNamesTheLine) {
  const Config config =
      parse_config("count: 4\nscene:\n  size: 0.25\n  levels: [1, 2]\n", "a.yaml");
  ASSERT_EQ(config.size(), 3u);
  EXPECT_EQ(config[1].key, "scene.size");
  EXPECT_EQ(config[1].where, "a.yaml:3");
  EXPECT_EQ(config[2].text, "1, 2");

  std::vector<Field> known = prefixed("scene.", fields_of(Inner{}));
  EXPECT_EQ(resolve({config[1]}, known), (Settings{{"scene.size", "0.25"}}));
  EXPECT_EQ(message_of([&] { resolve({config[0]}, known); }),
            "a.yaml:1: unknown key 'count'; known: scene.size");
  EXPECT_EQ(message_of([&] {
              resolve({{"scene.size", "0", "a.yaml:9"}}, known);
            }),
            "a.yaml:9: scene.size: expected a number > 0, found '0' (unit: m)");
}

TEST(Config, PrintedYamlReadsBack) {
  std::vector<Field> known = fields_of(Outer{});
  for (const Field& field : prefixed("scene.", fields_of(Outer{}))) known.push_back(field);
  const Settings settings = {
      {"scene.size", "0.125"}, {"title", "a: \"b\" # c"}, {"colour", "green"}};
  EXPECT_EQ(resolve(parse_config(config_yaml(known, settings), "printed"), known), settings);
}

TEST(Config, RefusesWhatIsNotKeysAndValues) {
  for (const char* text :
       {"", "- 1\n- 2\n", "a: [1, [2]]\n", "a:\n", "a: 1\na: 2\n", "a: {b\n", "\x01\x02\xff"})
    EXPECT_THROW(parse_config(text, "bad.yaml"), std::invalid_argument) << text;
}

}  // namespace
}  // namespace minescan
