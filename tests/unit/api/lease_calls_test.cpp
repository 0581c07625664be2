// LeaseService through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/lease_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LeaseCalls : public Serving {
 protected:
  void SetUp() override {
    serve();
    leases_ = v1::LeaseService::NewStub(channel_);
    request_.add_axes("feeder");
  }
  grpc::Status acquire() {
    Call context;
    return leases_->AcquireLease(&context, request_, &granted_);
  }

  std::unique_ptr<v1::LeaseService::Stub> leases_;
  v1::AcquireLeaseRequest request_;
  v1::AcquireLeaseResponse granted_;
};

TEST_F(LeaseCalls, AcquireCarriesEverythingAndGivesTheToken) {
  request_.add_axes("turntable");
  request_.add_axes("feeder");
  request_.mutable_ttl()->set_seconds(3);
  request_.set_label("panel 2");
  request_.set_take(true);
  request_.set_request_id("r-1");
  ASSERT_TRUE(acquire().ok());
  EXPECT_THAT(machine_.leases().log(), ElementsAre("acquire feeder+turntable by " + own_name() +
                                                   " as 'panel 2' ttl 3000 take true id 'r-1'"));
  EXPECT_EQ(granted_.lease_token(), 7U);
  EXPECT_EQ(granted_.lease().client(), own_name());
  EXPECT_EQ(granted_.lease().label(), "panel 2");
  EXPECT_THAT(granted_.lease().axes(), ElementsAre("feeder", "turntable"));
  EXPECT_EQ(granted_.lease().ttl().seconds(), 2);
  EXPECT_EQ(granted_.lease().remaining().seconds(), 1);
  ASSERT_EQ(granted_.taken_size(), 1) << "what had expired already was nobody's";
  EXPECT_EQ(granted_.taken(0).client(), "other");
}

TEST_F(LeaseCalls, AGroupStandsForItsAxes) {
  request_.add_axes("gantry");
  ASSERT_TRUE(acquire().ok());
  EXPECT_THAT(machine_.leases().log(), ElementsAre(HasSubstr("acquire feeder+table by")));
}

TEST_F(LeaseCalls, MalformedRequestsAreRefusedHere) {
  const auto refused = [this](v1::Reason reason, std::string_view text) {
    const auto status = acquire();
    EXPECT_EQ(detail_of(status).reason(), reason);
    EXPECT_THAT(status.error_message(), HasSubstr(text));
  };
  request_.clear_axes();
  refused(v1::REASON_INVALID_ARGUMENT, "axes is empty");
  request_.add_axes("nobody");
  refused(v1::REASON_UNKNOWN_AXIS, "nobody");
  request_.set_axes(0, "feeder");
  request_.set_label("two\nlines");
  refused(v1::REASON_INVALID_ARGUMENT, "label");
  request_.set_label(std::string(65, 'x'));
  refused(v1::REASON_INVALID_ARGUMENT, "label");
  request_.clear_label();
  request_.set_request_id("with space");
  refused(v1::REASON_INVALID_ARGUMENT, "request_id");
  request_.clear_request_id();
  request_.mutable_ttl()->set_nanos(-1);
  request_.mutable_ttl()->set_seconds(1);
  refused(v1::REASON_INVALID_ARGUMENT, "ttl");
  EXPECT_TRUE(machine_.leases().log().empty());
}

TEST_F(LeaseCalls, RenewReleaseAndListAreTheHolders) {
  ASSERT_TRUE(acquire().ok());
  v1::RenewLeaseRequest renew;
  renew.set_lease_token(7);
  v1::RenewLeaseResponse renewed;
  Call first;
  ASSERT_TRUE(leases_->RenewLease(&first, renew, &renewed).ok());
  EXPECT_EQ(renewed.lease().remaining().seconds(), 1);
  v1::ListLeasesResponse listed;
  Call second;
  ASSERT_TRUE(leases_->ListLeases(&second, {}, &listed).ok());
  ASSERT_EQ(listed.leases_size(), 1);
  EXPECT_THAT(listed.leases(0).axes(), ElementsAre("feeder"));
  v1::ReleaseLeaseRequest release;
  release.set_lease_token(7);
  v1::ReleaseLeaseResponse released;
  Call third;
  ASSERT_TRUE(leases_->ReleaseLease(&third, release, &released).ok());
  EXPECT_EQ(machine_.leases().log().at(1), "renew by " + own_name() + " under 7");
  EXPECT_EQ(machine_.leases().log().at(2), "release by " + own_name() + " under 7");
}

TEST_F(LeaseCalls, TheMachinesRefusalIsTheCalls) {
  machine_.leases().refuse_with(Error{.reason = Reason::lease_required, .message = "leased by other"});
  const auto status = acquire();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_LEASE_REQUIRED);
  v1::RenewLeaseRequest renew;
  v1::RenewLeaseResponse renewed;
  machine_.leases().refuse_with(Error{.reason = Reason::lease_lost, .message = "other took it"});
  Call context;
  EXPECT_EQ(leases_->RenewLease(&context, renew, &renewed).error_code(), grpc::StatusCode::ABORTED);
}

/// What a client waits for must never cost it its leases.
TEST_F(LeaseCalls, RenewingDoesNotCountAmongTheCallsInProgress) {
  machine_.hold();
  std::vector<std::unique_ptr<Call>> calls;
  std::vector<std::unique_ptr<v1::ListLeasesResponse>> answers;
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<grpc::ClientAsyncResponseReader<v1::ListLeasesResponse>>> readers;
  std::vector<grpc::Status> statuses(256);
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    calls.push_back(std::make_unique<Call>());
    answers.push_back(std::make_unique<v1::ListLeasesResponse>());
    readers.push_back(leases_->AsyncListLeases(calls.back().get(), {}, &queue));
    readers.back()->Finish(answers.back().get(), &statuses[i], answers.back().get());
  }
  EXPECT_TRUE(eventually([this] { return machine_.held() >= 256; }));
  EXPECT_EQ(detail_of(acquire()).reason(), v1::REASON_BUSY);
  v1::RenewLeaseRequest renew;
  renew.set_lease_token(7);
  v1::RenewLeaseResponse renewed;
  Call context;
  auto renewal = leases_->AsyncRenewLease(&context, renew, &queue);
  grpc::Status status;
  renewal->Finish(&renewed, &status, &renewed);
  EXPECT_TRUE(eventually([this] { return machine_.held() >= 257; })) << "it reached the machine";
  machine_.let_go();
  void* tag = nullptr;
  bool ok = false;
  for (std::size_t i = 0; i <= statuses.size(); ++i) ASSERT_TRUE(queue.Next(&tag, &ok));
  EXPECT_TRUE(status.ok());
  queue.Shutdown();
  EXPECT_FALSE(queue.Next(&tag, &ok));
}

}  // namespace
}  // namespace axisd::testing
