#include "api/axisctl/plot.hpp"

#include <gmock/gmock.h>

namespace axisd::axisctl {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(Ticks, AreRoundAndFew) {
  EXPECT_THAT(ticks(0, 120), ElementsAre(0, 20, 40, 60, 80, 100, 120));
  EXPECT_THAT(ticks(-3, 2.7), ElementsAre(-3, -2, -1, 0, 1, 2));
  for (const double span : {1e-6, 0.3, 2.7, 9.0, 47.0, 400.0, 7e5})
    for (const double low : {-span, 0.0, span / 3}) {
      const auto values = ticks(low, low + span);
      EXPECT_GE(values.size(), 3U) << span;
      EXPECT_LE(values.size(), 8U) << span;
      EXPECT_GE(values.front(), low - span * 1e-9);
      EXPECT_LE(values.back(), low + span * (1 + 1e-9));
    }
}

TEST(Svg, DrawsBothLinesAndTheTarget) {
  const Plot plot{.title = "feeder <1>",
                  .subtitle = "a & b",
                  .unit = "mm",
                  .samples = {{.time = 0, .position = 0, .velocity = 0, .target = {}},
                              {.time = 1, .position = 50, .velocity = 100, .target = 100},
                              {.time = 2, .position = 100, .velocity = 0, .target = 100}}};
  const auto picture = svg(plot);
  // Of 840 pixels' width and 220 pixels' height, 6 % of the range above and below.
  EXPECT_THAT(picture, HasSubstr("class='position' d='M90.0 292.2L510.0 194.0L930.0 95.8'"));
  EXPECT_THAT(picture, HasSubstr("class='velocity' d='M90.0 538.2L510.0 341.8L930.0 538.2'"));
  EXPECT_THAT(picture, HasSubstr("class='target' d='M510.0 95.8L930.0 95.8'"));
  EXPECT_THAT(picture, HasSubstr("feeder &lt;1>"));
  EXPECT_THAT(picture, HasSubstr("a &amp; b"));
  EXPECT_THAT(picture, HasSubstr("velocity, mm/s"));
}

TEST(Svg, NeedsNoRange) {
  const auto picture = svg({.title = "dial", .subtitle = "", .unit = "deg", .samples = {{.position = 7}}});
  EXPECT_THAT(picture, HasSubstr("class='position' d='M90.0 194.0'"));
  EXPECT_THAT(picture, Not(HasSubstr("nan")));
  EXPECT_THAT(picture, Not(HasSubstr("class='target' d")));
}

}  // namespace
}  // namespace axisd::axisctl
