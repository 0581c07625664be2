// SystemService.GetConfig and CheckConfig through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

/// Finds fault with the text "bad" only.
class FakeConfiguration final : public ConfigurationAccess {
 public:
  [[nodiscard]] const ServedConfiguration& served() const override { return served_; }
  [[nodiscard]] ConfigurationCheck check(std::string_view yaml) const override {
    ConfigurationCheck result{.revision = "of " + std::string(yaml)};
    if (yaml == "bad")
      result.findings = {{.line = 3, .column = 7, .message = "unknown key 'bad'", .suggestion = "remove it"},
                         {.message = "too large"}};
    return result;
  }

 private:
  ServedConfiguration served_{.yaml = "machine: press-1\n",
                              .path = "/etc/axisd/axisd.yaml",
                              .revision = "r1",
                              .served_since = WallTime(std::chrono::seconds(100))};
};

class ConfigCalls : public Serving {
 protected:
  grpc::Status get() {
    Call context;
    return v1::SystemService::NewStub(channel_)->GetConfig(&context, {}, &served_);
  }
  grpc::Status check(const std::string& yaml) {
    Call context;
    v1::CheckConfigRequest request;
    request.set_yaml(yaml);
    checked_.Clear();
    return v1::SystemService::NewStub(channel_)->CheckConfig(&context, request, &checked_);
  }

  FakeConfiguration configuration_;
  v1::GetConfigResponse served_;
  v1::CheckConfigResponse checked_;
};

TEST_F(ConfigCalls, WhatIsServedComesWhole) {
  serve({.configuration = &configuration_});
  ASSERT_TRUE(get().ok());
  EXPECT_EQ(served_.yaml(), "machine: press-1\n");
  EXPECT_EQ(served_.path(), "/etc/axisd/axisd.yaml");
  EXPECT_EQ(served_.revision(), "r1");
  EXPECT_EQ(served_.served_since().seconds(), 100);
}

TEST_F(ConfigCalls, FindingsAreAnAnswer) {
  serve({.configuration = &configuration_});
  ASSERT_TRUE(check("bad").ok());
  ASSERT_EQ(checked_.findings_size(), 2);
  EXPECT_EQ(checked_.findings(0).line(), 3U);
  EXPECT_EQ(checked_.findings(0).column(), 7U);
  EXPECT_EQ(checked_.findings(0).message(), "unknown key 'bad'");
  EXPECT_EQ(checked_.findings(0).suggestion(), "remove it");
  EXPECT_EQ(checked_.findings(1).line(), 0U);
  EXPECT_EQ(checked_.revision(), "of bad");
  ASSERT_TRUE(check("good").ok());
  EXPECT_EQ(checked_.findings_size(), 0);
}

TEST_F(ConfigCalls, WithoutAFileTheyAreRefused) {
  serve();
  for (const auto& status : {get(), check("good")}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_NOT_SUPPORTED);
  }
}

}  // namespace
}  // namespace axisd::testing
