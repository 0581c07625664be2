#include "api/axisctl/address.hpp"

#include <gtest/gtest.h>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

TEST(Address, AHostAloneMeansTheUsualPort) {
  EXPECT_EQ(with_port("press-1", usual_port), "press-1:7443");
  EXPECT_EQ(with_port("press-1.example", usual_stop_port), "press-1.example:7444");
  EXPECT_EQ(with_port("192.168.1.5", usual_port), "192.168.1.5:7443");
  EXPECT_EQ(with_port("::1", usual_port), "[::1]:7443");
  EXPECT_EQ(with_port("[fe80::1]", usual_port), "[fe80::1]:7443");
}

TEST(Address, WhatIsCompleteStaysAsItIs) {
  for (const char* address :
       {"press-1:8000", "[::1]:8000", "unix:/run/axisd/axisd.sock", "dns:press-1:8000", "dns:press-1",
        "dns:///press-1", "ipv4:10.0.0.1:8000", "unix-abstract:axisd", ""})
    EXPECT_EQ(with_port(address, usual_port), address);
}

TEST(Address, ANumberThatIsNoPortIsRefused) {
  for (const char* address : {"press-1:65536", "press-1:99999999999", "press-1:0", "press-1:", "[::1]:70000",
                              "ipv4:10.0.0.1:70000", "localhost:abc", "press-1:7443x"})
    EXPECT_THROW((void)with_port(address, usual_port), Failure) << address;
  EXPECT_EQ(with_port("press-1:65535", usual_port), "press-1:65535");
}

}  // namespace
}  // namespace axisd::axisctl
