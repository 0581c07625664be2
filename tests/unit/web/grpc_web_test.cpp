#include "api/web/gateway/grpc_web.hpp"

#include <gmock/gmock.h>

namespace axisd::web {
namespace {

using namespace std::string_literals;

TEST(GrpcWeb, OnlyCallsOfAxisdArePassedOn) {
  EXPECT_TRUE(is_call_path("/axisd.v1.AxisService/Stop"));
  for (const auto* path :
       {"/axisd.v1.AxisService", "/axisd.v1.AxisService/", "/axisd.v1./Stop", "/axisd.v1.A/B/C",
        "/grpc.health.v1.Health/Check", "/axisd.v1.A/../B", "/axisd.v1.A/B?x", ""})
    EXPECT_FALSE(is_call_path(path)) << path;
  EXPECT_FALSE(is_call_path("/axisd.v1.A/" + std::string(65, 'B')));
}

TEST(GrpcWeb, TakesExactlyOneMessage) {
  EXPECT_EQ(message_of("\0\0\0\0\3abc"s).value(), "abc");
  EXPECT_EQ(message_of("\0\0\0\0\0"s).value(), "");
  const auto code = [](std::string_view body) { return message_of(body).error().code; };
  EXPECT_EQ(code(""), code::invalid_argument);
  EXPECT_EQ(code("\0\0\0\0"s), code::invalid_argument) << "half a head";
  EXPECT_EQ(code("\0\0\0\0\3ab"s), code::invalid_argument) << "half a frame";
  EXPECT_EQ(code("\0\xFF\xFF\xFF\xFF"
                 "ab"s),
            code::invalid_argument);
  EXPECT_EQ(code("\0\0\0\0\1ab"s), code::invalid_argument) << "more than one";
  EXPECT_EQ(code("\1\0\0\0\1a"s), code::unimplemented) << "compressed";
  EXPECT_EQ(code("\x80\0\0\0\1a"s), code::invalid_argument) << "trailers";
}

TEST(GrpcWeb, EndsWithTrailers) {
  EXPECT_EQ(trailers_frame({}), "\x80\0\0\0\x10grpc-status: 0\r\n"s);
  EXPECT_THAT(
      trailers_frame({.code = 9, .message = "100 %\n", .details = "\1\2"}),
      testing::EndsWith("grpc-status: 9\r\ngrpc-message: 100 %25%0A\r\ngrpc-status-details-bin: AQI=\r\n"));
}

TEST(GrpcWeb, EncodesBytes) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("\xFF\xFE\xFD\xFC"s), "//79/A==");
}

}  // namespace
}  // namespace axisd::web
