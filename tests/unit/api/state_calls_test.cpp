// SystemService.BackUpState through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

struct FakeCopies final : StateCopies {
  void copy_state(std::function<void(Result<StateCopy>)> callback) override { callback(answer); }
  Result<StateCopy> answer = StateCopy{.text = "axisd-state 2\n", .generation = 41};
};

class StateCalls : public Serving {
 protected:
  grpc::Status back_up() {
    Call context;
    response_.Clear();
    return v1::SystemService::NewStub(channel_)->BackUpState(&context, {}, &response_);
  }
  FakeCopies copies_;
  v1::BackUpStateResponse response_;
};

TEST_F(StateCalls, ABackupIsTheFileAsItIs) {
  serve({.state_copies = &copies_});
  ASSERT_TRUE(back_up().ok());
  EXPECT_EQ(response_.state(), "axisd-state 2\n");
  EXPECT_EQ(response_.generation(), 41U);
}

TEST_F(StateCalls, WhatCannotBeReadSaysWhy) {
  copies_.answer = fail(Reason::storage, "cannot read state.v1", "check the disk");
  serve({.state_copies = &copies_});
  const auto status = back_up();
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_STORAGE);
}

TEST_F(StateCalls, AServerWithoutAStateSaysSo) {
  serve();
  EXPECT_EQ(detail_of(back_up()).reason(), v1::REASON_NOT_SUPPORTED);
}

}  // namespace
}  // namespace axisd::testing
