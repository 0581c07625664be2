// SystemService.GetConfig, CheckConfig and ReloadConfig through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

/// Finds fault with the text "bad" only.
class FakeConfiguration final : public ConfigurationAccess {
 public:
  [[nodiscard]] std::shared_ptr<const ServedConfiguration> served() const override {
    return std::make_shared<const ServedConfiguration>(served_);
  }
  void file_revision(std::function<void(Result<std::string>)> callback) override { callback("r2"); }
  void check(std::string yaml, std::function<void(Result<ConfigurationCheck>)> callback) override {
    ConfigurationCheck result{.revision = "of " + yaml};
    if (yaml == "bad")
      result.findings = {{.line = 3, .column = 7, .message = "unknown key 'bad'", .suggestion = "remove it"},
                         {.message = "too large"}};
    callback(std::move(result));
  }
  void reload(std::string client, bool dry_run,
              std::function<void(Result<ConfigurationReload>)> callback) override {
    asked.push_back(client + (dry_run ? " asks" : " reloads"));
    callback(answer);
  }
  Result<ConfigurationReload> answer = ConfigurationReload{};
  std::vector<std::string> asked;

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

  grpc::Status reload(bool dry_run = false) {
    Call context;
    v1::ReloadConfigRequest request;
    request.set_dry_run(dry_run);
    reloaded_.Clear();
    return v1::SystemService::NewStub(channel_)->ReloadConfig(&context, request, &reloaded_);
  }

  FakeConfiguration configuration_;
  v1::ReloadConfigResponse reloaded_;
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
  EXPECT_EQ(served_.file_revision(), "r2") << "edited since";
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

TEST_F(ConfigCalls, AReloadTellsWhatChanged) {
  serve({.configuration = &configuration_});
  configuration_.answer = ConfigurationReload{
      .applied = true,
      .warnings = {"line-a: slow"},
      .changes = {{.section = "axes", .name = "feeder", .keys = {"limits.velocity", "scale.invert"}},
                  {.section = "groups", .name = "both", .kind = ConfigurationChangeKind::removed}},
      .before = "r1",
      .revision = "r2"};
  ASSERT_TRUE(reload().ok());
  EXPECT_TRUE(reloaded_.applied());
  EXPECT_THAT(reloaded_.warnings(), ::testing::ElementsAre("line-a: slow"));
  EXPECT_EQ(reloaded_.previous_revision(), "r1");
  EXPECT_EQ(reloaded_.revision(), "r2");
  ASSERT_EQ(reloaded_.changes_size(), 2);
  EXPECT_EQ(reloaded_.changes(0).section(), "axes");
  EXPECT_EQ(reloaded_.changes(0).name(), "feeder");
  EXPECT_EQ(reloaded_.changes(0).kind(), v1::CONFIG_CHANGE_KIND_CHANGED);
  EXPECT_THAT(reloaded_.changes(0).keys(), ::testing::ElementsAre("limits.velocity", "scale.invert"));
  EXPECT_EQ(reloaded_.changes(1).kind(), v1::CONFIG_CHANGE_KIND_REMOVED);
  ASSERT_TRUE(reload(true).ok());
  EXPECT_THAT(configuration_.asked,
              ::testing::ElementsAre(::testing::EndsWith(" reloads"), ::testing::EndsWith(" asks")));
}

TEST_F(ConfigCalls, WhatStandsAgainstAReloadIsAnAnswer) {
  serve({.configuration = &configuration_});
  configuration_.answer = ConfigurationReload{
      .findings = {{.line = 3, .column = 7, .message = "unknown key 'bad'", .suggestion = "remove it"}},
      .refusals = {{.reason = Reason::moving, .message = "feeder moves", .remedy = "stop it"}}};
  ASSERT_TRUE(reload().ok());
  EXPECT_FALSE(reloaded_.applied());
  ASSERT_EQ(reloaded_.findings_size(), 1);
  EXPECT_EQ(reloaded_.findings(0).line(), 3U);
  EXPECT_EQ(reloaded_.findings(0).suggestion(), "remove it");
  ASSERT_EQ(reloaded_.refusals_size(), 1);
  EXPECT_EQ(reloaded_.refusals(0).reason(), v1::REASON_MOVING);
  EXPECT_EQ(reloaded_.refusals(0).remedy(), "stop it");
  configuration_.answer = fail(Reason::busy, "another reload is under way");
  EXPECT_EQ(detail_of(reload()).reason(), v1::REASON_BUSY);
}

TEST_F(ConfigCalls, WithoutAFileTheyAreRefused) {
  serve();
  for (const auto& status : {get(), check("good"), reload()}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_NOT_SUPPORTED);
  }
}

}  // namespace
}  // namespace axisd::testing
