// Thousands of damaged state directories, each started from with all that depends on it: nothing that was
// given out is given out again, and no latch gets lost.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <random>
#include <set>

#include "daemon/core/stop_hold_keeper.hpp"
#include "daemon/store/kept_state.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/lease/lease_table.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::store {
namespace {

constexpr std::array<const char*, 3> names = {"state.v1", "state.v1.previous", "journal.v1"};
constexpr std::size_t state = 0, previous = 1, journal = 2;
constexpr auto mark_name = "journal-mark.v1";
using Files = std::array<std::string, names.size()>;

/// Disks are slow, and what is durable is not what is tested here.
std::filesystem::path memory() {
  return std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
}

/// What was given out, and answered for.
struct Given {
  std::set<std::string> moved;  ///< request ids
  std::set<std::uint64_t> tokens, starts;
  bool latched = false, held = false;
};

/// What of the daemon depends on the files.
class Owners {
 public:
  explicit Owners(const std::filesystem::path& directory) {
    auto opened = KeptState::open(directory, WallTime(std::chrono::hours(1)), core_.get_executor());
    if (!opened) {
      refusal = opened.error();
      return;
    }
    kept_ = *std::move(opened);
    const auto start = loaded().start_count;
    book_ = std::make_unique<CommandBook>(clock_, fmt::format("{:x}", start), &kept_->journal());
    leases_ = std::make_unique<LeaseTable>(LeaseSettings{}, start);
    holds_ = std::make_unique<core::StopHoldKeeper>(
        clock_, &kept_->state(), [](const auto&, const auto&) {}, [](auto) {});
  }

  std::optional<Error> refusal;

  [[nodiscard]] const StoredState& loaded() const { return kept_->state().loaded(); }
  [[nodiscard]] bool held() { return !holds_->of("x")->empty(); }
  [[nodiscard]] std::uint64_t token() {
    return leases_->acquire({.client = "hmi", .axes = {"x"}, .take = true}, clock_.now())->lease.token;
  }
  /// True: the start of this request is sent.
  bool move(const std::string& id) {
    const CommandOptions options{.client = "hmi", .request_id = id};
    const auto known = book_->find_repeat("x", MoveRelativeRequest{.distance = 1}, options);
    if (!known || *known) return false;
    const auto command = book_->open("x", MoveRelativeRequest{.distance = 1}, options);
    const bool sent = answered([&](auto done) { book_->sending(command, {}, std::move(done)); }).has_value();
    if (sent) command->done();
    return sent;
  }
  /// As after each motion.
  void rest() {
    EXPECT_TRUE(answered([&](auto done) {
      kept_->state().save_offset("x", {.offset_pulses = ++position_}, std::move(done));
    }));
  }
  void latch(bool active) {
    EXPECT_TRUE(answered([&](auto done) {
      kept_->state().save_inhibit({.active = active, .by = "panel", .since = {}}, std::move(done));
    }));
  }
  void hold(bool active) {
    if (active) {
      bool settled = false;
      holds_->add("x", {.holder = "hmi", .request_id = {}}, {}, [&] { settled = true; });
      while (!settled) core_.run_one();
    } else {
      EXPECT_TRUE(answered([&](auto done) { holds_->release("x", {.client = "hmi"}, std::move(done)); }));
    }
  }
  void accept() {
    EXPECT_TRUE(answered([&](auto done) { kept_->state().accept_state(std::move(done)); }));
  }

 private:
  template <class Ask>
  Result<void> answered(Ask ask) {
    std::optional<Result<void>> answer;
    ask([&](const Result<void>& result) { answer = result; });
    while (!answer) core_.run_one();
    return *answer;
  }

  boost::asio::io_context core_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> running_ =
      boost::asio::make_work_guard(core_);
  test::VirtualClock clock_;
  std::int64_t position_ = 0;
  std::unique_ptr<KeptState> kept_;
  std::unique_ptr<CommandBook> book_;
  std::unique_ptr<LeaseTable> leases_;
  std::unique_ptr<core::StopHoldKeeper> holds_;
};

/// A machine's life: as its files were at each moment, and what it had given out by then.
struct Moment {
  Files files;
  std::string mark;  ///< of the journal
  Given given;
  bool end_of_run = false;
  std::size_t run = 0;
};

std::vector<Moment> life() {
  const test::TemporaryDirectory directory(memory());
  std::vector<Moment> moments;
  Given given;
  const auto look = [&](std::size_t run, bool end) {
    moments.push_back({.given = given, .end_of_run = end, .run = run});
    for (std::size_t i = 0; i < names.size(); ++i) moments.back().files.at(i) = directory.read(names.at(i));
    moments.back().mark = directory.read(mark_name);
  };
  for (std::size_t run = 0; run < 8; ++run) {
    {
      Owners owners(directory.path());
      EXPECT_FALSE(owners.refusal);
      EXPECT_TRUE(owners.loaded().convictions.empty()) << to_string(owners.loaded().convictions);
      EXPECT_EQ(owners.loaded().inhibit.active, given.latched);
      EXPECT_EQ(owners.held(), given.held);
      EXPECT_TRUE(given.starts.insert(owners.loaded().start_count).second);
      EXPECT_TRUE(given.tokens.insert(owners.token()).second);
      for (int step = 0; step < 4; ++step) {
        const auto id = fmt::format("r{}-{}", run, step);
        EXPECT_TRUE(owners.move(id));
        given.moved.insert(id);
        if ((run + static_cast<std::size_t>(step)) % 3 == 0) owners.latch(given.latched = !given.latched);
        if ((run + static_cast<std::size_t>(step)) % 4 == 0) owners.hold(given.held = !given.held);
        owners.rest();
        look(run, false);
      }
    }
    look(run, true);
  }
  return moments;
}

enum class Damage { none, missing, truncated, flipped, fifo, link, directory, empty, old, swapped };
using Damages = std::array<Damage, names.size()>;

class Generator {
 public:
  explicit Generator(const std::vector<Moment>& life) : life_(&life) {}

  [[nodiscard]] const Moment& moment() {
    return life_->at(life_->size() / 2 + random_() % (life_->size() - life_->size() / 2));
  }
  /// `marked`: the journal's mark is as it was.
  Damages damages(bool marked) {
    Damages all{};
    for (auto& damage : all)
      if (random_() % 2 == 0) damage = static_cast<Damage>(random_() % 10);
    // Old copies of all files are as good as what they were copied from; so is a journal cut to its old
    // length.
    if (!marked && all[state] == Damage::old && all[previous] == Damage::old)
      if (all[journal] == Damage::old || all[journal] == Damage::truncated) all[journal] = Damage::missing;
    // Without any file it is a first start.
    if (std::ranges::count(all, Damage::missing) == std::ssize(all)) all[journal] = Damage::none;
    if (all[state] == Damage::swapped || all[journal] == Damage::swapped)
      all[state] = all[journal] = Damage::swapped;
    return all;
  }
  /// Of an earlier run, and of its end: a copy is made of a machine that stands still.
  const Files& old_copy(const Moment& now) {
    std::vector<const Moment*> ends;
    for (const auto& moment : *life_)
      if (moment.end_of_run && moment.run < now.run) ends.push_back(&moment);
    return ends.at(random_() % ends.size())->files;
  }
  std::size_t below(std::size_t bound) { return random_() % bound; }

 private:
  const std::vector<Moment>* life_;
  std::mt19937 random_{20261125};
};

void put(const test::TemporaryDirectory& directory, const Moment& moment, const Damages& damages,
         Generator& generator) {
  const auto& old = generator.old_copy(moment);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto path = directory / names.at(i);
    auto text = moment.files.at(i);
    switch (damages.at(i)) {
      case Damage::missing:
        continue;
      case Damage::fifo:
        ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
        continue;
      case Damage::directory:
        std::filesystem::create_directory(path);
        continue;
      case Damage::link:
        directory.write("elsewhere", text);
        std::filesystem::create_symlink("elsewhere", path);
        continue;
      case Damage::truncated:
        text.resize(generator.below(text.size()));
        break;
      case Damage::flipped: {
        auto& byte = text[generator.below(text.size())];
        byte = static_cast<char>(byte ^ (1 << generator.below(8)));
        break;
      }
      case Damage::empty:
        text.clear();
        break;
      case Damage::old:
        text = old.at(i);
        break;
      case Damage::swapped:
        text = moment.files.at(i == journal ? state : journal);
        break;
      case Damage::none:
        break;
    }
    directory.write(names.at(i), text);
  }
  // What a start only writes is not waited for either.
  if (generator.below(4) == 0) mkfifo((directory / "state.v1.new").c_str(), 0600);
  if (generator.below(4) == 0) std::filesystem::create_symlink("elsewhere", directory / "journal.v1.new");
}

/// A journal that got another version of its format may be whole all the same; so may one without its last
/// lines, unless its mark tells of them.
bool certainly_noticed(Damage damage, std::size_t file, bool marked) {
  if (file == journal && damage == Damage::truncated) return marked;
  return damage != Damage::none && (file != journal || damage != Damage::flipped);
}

void judge_start(Owners& owners, const Moment& moment, const Damages& damages, bool marked) {
  const auto& given = moment.given;
  const auto& loaded = owners.loaded();
  EXPECT_FALSE(given.starts.contains(loaded.start_count)) << loaded.start_count << ": ids of commands repeat";
  EXPECT_FALSE(given.tokens.contains(owners.token()));
  for (const auto& id : given.moved) EXPECT_FALSE(owners.move(id)) << id << " moves again";
  if (given.latched) EXPECT_TRUE(loaded.inhibit.active) << "the latch is lost";
  if (given.held) EXPECT_TRUE(owners.held() || loaded.inhibit.active) << "the hold is lost";
  for (std::size_t i = 0; i < names.size(); ++i)
    if (certainly_noticed(damages.at(i), i, marked)) EXPECT_FALSE(loaded.convictions.empty()) << names.at(i);
}

TEST(DamagedState, NothingIsGivenOutTwiceAndNoLatchIsLost) {
  spdlog::set_level(spdlog::level::off);
  const auto moments = life();
  ASSERT_FALSE(testing::Test::HasFailure());
  Generator generator(moments);
  int started = 0, refused = 0, convicted = 0;
  for (int number = 0; number < 2'000 && !testing::Test::HasFailure(); ++number) {
    const auto& moment = generator.moment();
    const bool marked = generator.below(4) != 0;
    const auto damages = generator.damages(marked);
    SCOPED_TRACE(fmt::format("{}: run {}, damages {} {} {}", number, moment.run, int(damages[0]),
                             int(damages[1]), int(damages[2])));
    const test::TemporaryDirectory directory(memory());
    put(directory, moment, damages, generator);
    if (marked) directory.write(mark_name, moment.mark);
    std::uint64_t first = 0;
    {
      Owners owners(directory.path());
      if (owners.refusal) {
        ++refused;
        EXPECT_EQ(owners.refusal->reason, Reason::storage);
        EXPECT_EQ(to_string(*owners.refusal).find('\n'), std::string::npos);
        EXPECT_NE(owners.refusal->remedy, "");
        continue;
      }
      ++started;
      first = owners.loaded().start_count;
      judge_start(owners, moment, damages, marked);
      if (!owners.loaded().convictions.empty()) {
        ++convicted;
        owners.accept();
      }
    }
    if (number % 4 != 0) continue;
    Owners again(directory.path());
    ASSERT_FALSE(again.refusal) << to_string(*again.refusal);
    EXPECT_EQ(to_string(again.loaded().convictions), "") << "accepted, and a restart is no conviction";
    EXPECT_EQ(again.loaded().start_count, first + 1);
    judge_start(again, moment, {}, marked);
  }
  spdlog::set_level(spdlog::level::info);
  EXPECT_GT(convicted, 1'000);
  EXPECT_GT(started - convicted, 50);
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace axisd::store
