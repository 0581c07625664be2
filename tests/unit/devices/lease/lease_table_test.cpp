// Who may command which axis: pure, time comes with each call.
#include "devices/lease/lease_table.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr TimePoint start{1h};

class Leases : public ::testing::Test {
 protected:
  Lease acquire(LeaseRequest request, TimePoint now = start) {
    const auto grant = table_.acquire(request, now);
    EXPECT_TRUE(grant) << (grant ? "" : to_string(grant.error()));
    return grant ? grant->lease : Lease{};
  }
  [[nodiscard]] Reason refused(std::string_view axis, const Requester& requester,
                               TimePoint now = start) const {
    const auto allowed = table_.check(axis, requester, now);
    EXPECT_FALSE(allowed);
    return allowed ? Reason::internal : allowed.error().reason;
  }

  LeaseTable table_{{}, 3};
};

TEST_F(Leases, AFreeAxisIsEverybodysWithoutAToken) {
  EXPECT_TRUE(table_.check("x", {.client = "a"}, start));
  EXPECT_EQ(refused("x", {.client = "a", .lease_token = 7}), Reason::lease_lost);
  LeaseTable leased({.required = true}, 3);
  EXPECT_EQ(leased.check("x", {.client = "a"}, start).error().reason, Reason::lease_required);
  const auto lease = leased.acquire({.client = "a", .axes = {"x"}}, start)->lease;
  EXPECT_TRUE(leased.check("x", {.client = "a", .lease_token = lease.token}, start));
}

TEST_F(Leases, ALeasedAxisNeedsItsTokenFromItsHolder) {
  const auto lease = acquire({.client = "a", .label = "panel 2", .axes = {"x", "y"}});
  EXPECT_TRUE(table_.check("x", {.client = "a", .lease_token = lease.token}, start));
  EXPECT_TRUE(table_.check("y", {.client = "a", .lease_token = lease.token}, start));
  EXPECT_TRUE(table_.check("z", {.client = "a"}, start));
  const auto without = table_.check("x", {.client = "a"}, start + 500ms);
  EXPECT_EQ(without.error().reason, Reason::lease_required);
  EXPECT_THAT(without.error().message, HasSubstr("leased by a (panel 2) for another 1.5 s"));
  EXPECT_THAT(without.error().remedy, HasSubstr("--take"));
  EXPECT_THAT(without.error().remedy, HasSubstr("give its token (axisctl: --lease TOKEN or AXISD_LEASE)"));
  const auto stranger = table_.check("x", {.client = "b"}, start);
  EXPECT_THAT(stranger.error().remedy, ::testing::StartsWith("ask its holder, wait, or take it over: "));
  // Tokens can be guessed: they count only for who acquired them.
  EXPECT_EQ(refused("x", {.client = "b", .lease_token = lease.token}), Reason::lease_required);
  EXPECT_EQ(table_.renew({.client = "b", .lease_token = lease.token}, start).error().reason,
            Reason::lease_required);
  EXPECT_EQ(table_.release({.client = "b", .lease_token = lease.token}, start).error().reason,
            Reason::lease_required);
  const auto elsewhere = table_.check("z", {.client = "a", .lease_token = lease.token}, start);
  EXPECT_EQ(elsewhere.error().reason, Reason::lease_required);
  EXPECT_THAT(elsewhere.error().message, HasSubstr("of x, y"));
}

TEST_F(Leases, AllAxesOrNone) {
  acquire({.client = "a", .axes = {"y"}});
  const auto refusal = table_.acquire({.client = "b", .axes = {"x", "y"}}, start);
  EXPECT_EQ(refusal.error().reason, Reason::lease_required);
  EXPECT_THAT(refusal.error().message, HasSubstr("y: leased by a"));
  EXPECT_EQ(table_.find("x"), nullptr);
  EXPECT_EQ(table_.list().size(), 1U);
  // The same client is no exception: several programs may share an identity.
  EXPECT_FALSE(table_.acquire({.client = "a", .axes = {"y"}}, start));
}

TEST_F(Leases, TheTimeToLiveCountsFromTheLastRenewal) {
  const auto lease = acquire({.client = "a", .axes = {"x"}, .ttl = 300ms});
  const Requester holder{.client = "a", .lease_token = lease.token};
  EXPECT_EQ(table_.next_expiry(), start + 300ms);
  EXPECT_EQ(table_.renew(holder, start + 299ms)->expires, start + 599ms);
  EXPECT_THAT(table_.expire(start + 598ms), IsEmpty());
  EXPECT_TRUE(table_.check("x", holder, start + 598ms));
  // From its end on it grants nothing, also before somebody looked.
  EXPECT_EQ(refused("x", holder, start + 599ms), Reason::lease_lost);
  EXPECT_TRUE(table_.check("x", {.client = "b"}, start + 599ms));
  EXPECT_EQ(table_.renew(holder, start + 599ms).error().reason, Reason::lease_lost);
  const auto over = table_.expire(start + 600ms);
  ASSERT_EQ(over.size(), 1U);
  EXPECT_EQ(over[0].end, LeaseEnd::expired);
  EXPECT_THAT(over[0].lease.axes, ElementsAre("x"));
  EXPECT_EQ(table_.next_expiry(), TimePoint::max());
}

TEST_F(Leases, BoundsOfTheTimeToLiveAreTheConfigurations) {
  LeaseTable table({.shortest_ttl = 200ms, .default_ttl = 1s, .longest_ttl = 5s}, 0);
  EXPECT_EQ(table.acquire({.client = "a", .axes = {"x"}}, start)->lease.ttl, 1s);
  for (const Duration ttl : {Duration(199ms), Duration(5001ms), Duration(-1s)}) {
    const auto refusal = table.acquire({.client = "a", .axes = {"y"}, .ttl = ttl}, start);
    EXPECT_EQ(refusal.error().reason, Reason::out_of_range);
    EXPECT_EQ(refusal.error().permitted->minimum, 0.2);
    EXPECT_EQ(refusal.error().permitted->maximum, 5);
  }
  EXPECT_TRUE(table.acquire({.client = "a", .axes = {"y"}, .ttl = 200ms}, start));
  EXPECT_TRUE(table.acquire({.client = "a", .axes = {"z"}, .ttl = 5s}, start));
}

TEST_F(Leases, TakingAnAxisEndsTheWholeLease) {
  const auto first = acquire({.client = "a", .axes = {"x", "y"}});
  const auto grant = table_.acquire({.client = "b", .axes = {"y", "z"}, .take = true}, start + 1s);
  ASSERT_TRUE(grant);
  ASSERT_EQ(grant->taken.size(), 1U);
  EXPECT_EQ(grant->taken[0].lease.token, first.token);
  EXPECT_EQ(grant->taken[0].end, LeaseEnd::taken);
  EXPECT_EQ(grant->taken[0].by, "b");
  EXPECT_EQ(table_.find("x"), nullptr);
  EXPECT_EQ(table_.find("y")->client, "b");
  const Requester late{.client = "a", .lease_token = first.token};
  const auto renewal = table_.renew(late, start + 1500ms);
  EXPECT_EQ(renewal.error().reason, Reason::lease_lost);
  EXPECT_THAT(renewal.error().message, HasSubstr("b took the lease 0.5 s ago"));
  const auto command = table_.check("y", late, start + 1500ms);
  EXPECT_EQ(command.error().reason, Reason::lease_lost);
  EXPECT_THAT(command.error().message, HasSubstr("y is leased by b for another 1.5 s"));
}

TEST_F(Leases, WhatHasExpiredCanBeAcquiredWithoutTaking) {
  acquire({.client = "a", .axes = {"x"}});
  const auto grant = table_.acquire({.client = "b", .axes = {"x"}}, start + 2s);
  ASSERT_TRUE(grant) << "nobody called expire() yet";
  ASSERT_EQ(grant->taken.size(), 1U);
  EXPECT_EQ(grant->taken[0].end, LeaseEnd::expired);
  EXPECT_THAT(table_.expire(start + 2s), IsEmpty()) << "it ends once";
}

TEST_F(Leases, ReleasedIsOverAtOnce) {
  const auto lease = acquire({.client = "a", .axes = {"x"}});
  const Requester holder{.client = "a", .lease_token = lease.token};
  EXPECT_EQ(table_.release(holder, start + 1s)->end, LeaseEnd::released);
  EXPECT_THAT(table_.release(holder, start + 1s).error().message, HasSubstr("was released"));
  EXPECT_TRUE(table_.check("x", {.client = "b"}, start + 1s));
  EXPECT_EQ(refused("x", holder, start + 1s), Reason::lease_lost);
}

TEST_F(Leases, TokensOnlyGrowAlsoOverRestarts) {
  const auto first = acquire({.client = "a", .axes = {"x"}});
  table_.expire(start + 1h);
  const auto second = acquire({.client = "a", .axes = {"x"}}, start + 1h);
  LeaseTable restarted({}, 4);
  const auto third = restarted.acquire({.client = "a", .axes = {"x"}}, start)->lease;
  EXPECT_NE(LeaseTable({}, 0).acquire({.client = "a", .axes = {"x"}}, start)->lease.token, 0U);
  EXPECT_LT(first.token, second.token);
  EXPECT_LT(second.token, third.token);
  const auto refusal = restarted.check("y", {.client = "a", .lease_token = second.token}, start);
  EXPECT_EQ(refusal.error().reason, Reason::lease_lost) << "an earlier run's token is stale";
}

TEST_F(Leases, ARepeatedRequestGetsItsLease) {
  const LeaseRequest request{.client = "a", .axes = {"x"}, .request_id = "r"};
  const auto lease = acquire(request);
  const auto repeat = table_.acquire(request, start + 1s);
  ASSERT_TRUE(repeat);
  EXPECT_TRUE(repeat->repeated);
  EXPECT_EQ(repeat->lease.token, lease.token);
  EXPECT_EQ(repeat->lease.expires, start + 3s);
  EXPECT_EQ(table_.acquire({.client = "a", .axes = {"y"}, .request_id = "r"}, start).error().reason,
            Reason::request_id_conflict);
  EXPECT_FALSE(table_.acquire({.client = "b", .axes = {"x"}, .request_id = "r"}, start));
  EXPECT_NE(acquire(request, start + 3s).token, lease.token) << "a lease that is over is another one";
}

/// Nobody has to be counted: a lease needs an axis that no other has, whoever asks and however often.
TEST_F(Leases, ThereAreNoMoreThanAxes) {
  const std::vector<std::string> axes = {"x", "y", "z"};
  for (int i = 0; i < 1'000; ++i) {
    const auto client = fmt::format("client {}", i % 100);
    const auto& axis = axes[static_cast<std::size_t>(i) % axes.size()];
    (void)table_.acquire({.client = client, .axes = {axis}, .request_id = fmt::format("{}", i)}, start);
    (void)table_.acquire({.client = client, .axes = {axis}, .take = i % 7 == 0}, start);
    if (i % 11 == 0) (void)table_.acquire({.client = client, .axes = axes, .take = true}, start);
    ASSERT_LE(table_.list().size(), axes.size());
    for (const auto& lease : table_.list())
      for (const auto& leased : lease.axes) ASSERT_EQ(table_.find(leased)->token, lease.token);
  }
}

TEST_F(Leases, ManyEndedOnesAreForgottenInTheEnd) {
  const auto first = acquire({.client = "a", .axes = {"x"}});
  for (int i = 1; i <= 300; ++i) table_.acquire({.client = "b", .axes = {"x"}, .take = true}, start);
  const auto lost = table_.renew({.client = "a", .lease_token = first.token}, start);
  EXPECT_EQ(lost.error().reason, Reason::lease_lost);
  EXPECT_THAT(lost.error().message, HasSubstr("there is no lease with this token"));
}

}  // namespace
}  // namespace axisd
