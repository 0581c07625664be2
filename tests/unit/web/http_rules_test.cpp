#include "api/web/gateway/http_rules.hpp"

#include <gmock/gmock.h>

#include "api/web/gateway/http_answer.hpp"
#include "api/web/gateway/rates.hpp"
#include "api/web/gateway/shares.hpp"

namespace axisd::web {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(HttpRules, KnowTheNamesOfThisComputer) {
  for (const auto* host :
       {"localhost", "localhost:7480", "LOCALHOST", "127.0.0.1", "127.0.0.1:80", "[::1]", "[::1]:7480"})
    EXPECT_TRUE(is_loopback_host(host)) << host;
  for (const auto* host : {"", "evil.example", "localhost.evil.example", "localhost:80x",
                           "127.0.0.1.evil.example", "::1", "[::1", "[::2]"})
    EXPECT_FALSE(is_loopback_host(host)) << host;
}

TEST(HttpRules, KnowPagesOfTheirOwn) {
  EXPECT_TRUE(is_same_origin("http://localhost:7480", "localhost:7480", false));
  EXPECT_TRUE(is_same_origin("https://press-1", "Press-1", true));
  EXPECT_FALSE(is_same_origin("http://press-1", "press-1", true)) << "without TLS";
  EXPECT_FALSE(is_same_origin("https://evil.example", "press-1", true));
  EXPECT_FALSE(is_same_origin("https://press-1.evil.example", "press-1", true));
  EXPECT_FALSE(is_same_origin("null", "press-1", true));
  EXPECT_FALSE(is_same_origin("", "", false));
  EXPECT_FALSE(is_same_origin("http://", "", false));
}

TEST(HttpRules, FindACookie) {
  EXPECT_EQ(cookie_of("a=1; axisd=xyz; b=2", "axisd"), "xyz");
  EXPECT_EQ(cookie_of("axisd=", "axisd"), "");
  EXPECT_FALSE(cookie_of("xaxisd=1; axisdx=2; axisd", "axisd"));
  EXPECT_FALSE(cookie_of("axisd=1; axisd=2", "axisd")) << "which of them?";
  EXPECT_FALSE(cookie_of("", "axisd"));
}

TEST(HttpRules, ReadWhatIsAccepted) {
  EXPECT_TRUE(accepts("br, gzip;q=0.5", "gzip"));
  EXPECT_TRUE(accepts("GZIP", "gzip"));
  EXPECT_FALSE(accepts("gzip;q=0", "gzip"));
  EXPECT_FALSE(accepts("gzip; q=0.000", "gzip"));
  EXPECT_FALSE(accepts("xgzip, br", "gzip"));
}

TEST(HttpAnswer, SaysWhatABrowserMayDo) {
  const auto bytes = to_bytes(plain(200, "ok"), true);
  EXPECT_THAT(bytes, HasSubstr("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(bytes, HasSubstr("Content-Length: 3\r\n"));
  EXPECT_THAT(bytes, HasSubstr("default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
                               "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; "
                               "frame-ancestors 'none'\r\n"));
  EXPECT_THAT(bytes, HasSubstr("X-Content-Type-Options: nosniff\r\n"));
  EXPECT_THAT(bytes, HasSubstr("Cache-Control: no-store\r\n"));
  EXPECT_THAT(bytes, Not(HasSubstr("Connection: close")));
  EXPECT_THAT(bytes, testing::EndsWith("\r\n\r\nok\n"));
}

TEST(HttpAnswer, TellsAClientOfGrpcWhyNot) {
  const auto bytes = to_bytes(refused_call(401, {.code = 16, .message = "nobody is logged in"}), false);
  EXPECT_THAT(bytes, HasSubstr("HTTP/1.1 401 Unauthorized\r\n"));
  EXPECT_THAT(bytes, HasSubstr("grpc-status: 16\r\n"));
  EXPECT_THAT(bytes, HasSubstr("grpc-message: nobody is logged in\r\n"));
  EXPECT_THAT(bytes, HasSubstr("Connection: close\r\n"));
}

TEST(HttpAnswer, ComesInChunks) {
  EXPECT_EQ(chunk("hello, this is more"), "13\r\nhello, this is more\r\n");
  EXPECT_THAT(head_of(200, grpc_web_type, std::nullopt, {}, true),
              HasSubstr("Transfer-Encoding: chunked\r\n"));
  EXPECT_THAT(head_of(204, {}, 0, {}, true), Not(HasSubstr("Content-Length")));
}

TEST(HttpAnswer, QuotesTextOfOthers) { EXPECT_EQ(json_text("a\"b\\c\n"), "\"a\\\"b\\\\c\\u000a\""); }

TEST(Rates, HaveATotalAndAShareForEach) {
  using namespace std::chrono_literals;
  Rates rates({.per_second = 10, .at_once = 3}, {.per_second = 1, .at_once = 2});
  TimePoint now{Duration(1h)};
  EXPECT_TRUE(rates.take("a", now) && rates.take("a", now));
  EXPECT_FALSE(rates.take("a", now)) << "its share";
  EXPECT_TRUE(rates.take("b", now));
  EXPECT_FALSE(rates.take("c", now)) << "all of them";
  now += 1s;
  EXPECT_TRUE(rates.take("a", now));
  EXPECT_FALSE(rates.take("a", now));
  EXPECT_TRUE(rates.take("b", now) && rates.take("b", now));
}

TEST(Shares, HaveATotalAndAShareForEach) {
  Shares shares(3, 2);
  auto a = shares.take("a"), b = shares.take("a");
  EXPECT_TRUE(a && b);
  EXPECT_FALSE(shares.take("a")) << "its share";
  auto c = shares.take("b");
  EXPECT_TRUE(c);
  EXPECT_TRUE(shares.full());
  EXPECT_FALSE(shares.take("c")) << "all of them";
  a.reset();
  EXPECT_TRUE(shares.take("c"));
  b = std::move(c);
  c.reset();
  EXPECT_EQ(shares.count(), 1);
}

}  // namespace
}  // namespace axisd::web
