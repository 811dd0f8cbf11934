// Success terms on the wire.
#include "web/wire_terms.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace flowscope::web {
namespace {

TEST(TermJson, HasTheNumberBehindTheWords) {
  SuccessTerm term{
      "item inside bin", true, "12.0 mm deep", "all/0", TermMeasure{-0.012, 0, "m", false}, 3.25};
  const auto json = wire::to_json(term);
  EXPECT_EQ(json.at("path"), "all/0");
  EXPECT_EQ(json.at("measured"), -0.012);
  EXPECT_EQ(json.at("threshold"), 0.0);
  EXPECT_EQ(json.at("unit"), "m");
  EXPECT_EQ(json.at("wanted"), "at most");
  EXPECT_EQ(json.at("first_met_s"), 3.25);
  term.measure.reset();
  term.first_met_s.reset();
  EXPECT_TRUE(wire::to_json(term).at("measured").is_null());
  EXPECT_TRUE(wire::to_json(term).at("first_met_s").is_null());
}

TEST(TermJson, SeriesKeepFourDigitsAndNoInfinities) {
  const TermSeries series{"near",
                          "",
                          TermMeasure{0, 0.01, "m", false},
                          {0.123456, 12345.6, -0.00001234567, std::numeric_limits<double>::infinity()},
                          {},
                          false};
  const auto json = wire::to_json(series);
  EXPECT_EQ(json.at("values").at(0), 0.1235);
  EXPECT_EQ(json.at("values").at(1), 12350.0);
  EXPECT_EQ(json.at("values").at(2), -1.235e-05);
  EXPECT_TRUE(json.at("values").at(3).is_null());
  EXPECT_FALSE(json.at("met_at_end"));
}

}  // namespace
}  // namespace flowscope::web
