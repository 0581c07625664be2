#include "api/axisctl/script.hpp"

#include <gmock/gmock.h>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

TEST(Script, HasAWordListPerLine) {
  const auto lines =
      parse_script("# to and fro\n\nmove feeder 120mm\t--wait   # there\r\n  axisctl list\n", "s");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].number, 3);
  EXPECT_THAT(lines[0].words, ElementsAre("move", "feeder", "120mm", "--wait"));
  EXPECT_EQ(lines[1].number, 4);
  EXPECT_THAT(lines[1].words, ElementsAre("list"));
}

TEST(Script, QuotesKeepBlanksAndCommentSigns) {
  const auto lines = parse_script(R"(a 'b c'd "e # f" '' g#h)", "s");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_THAT(lines[0].words, ElementsAre("a", "b cd", "e # f", "", "g#h"));
  EXPECT_EQ(text_of(lines[0]), "a 'b cd' 'e # f' '' 'g#h'");
}

TEST(Script, MayHoldNothing) { EXPECT_THAT(parse_script("# nothing\n\n axisctl \n", "s"), IsEmpty()); }

TEST(Script, AQuotationEndsInItsLine) {
  EXPECT_THAT([] { parse_script("list\nmove 'feeder\n' 3", "moves.txt"); },
              ThrowsMessage<Failure>(HasSubstr("moves.txt:2: a quotation has no end")));
}

}  // namespace
}  // namespace axisd::axisctl
