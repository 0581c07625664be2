// Bounded work per client and in all. Stops are exempt: they never ask here.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

#include "buses/error.hpp"

namespace axisd::server {

/// Counts what is in progress, of each client and in all, so that nobody can fill the core's queue or the
/// daemon's memory. The transport's own limit is far higher: a client's open calls must never lock out its
/// Stop. Thread: any.
class Admission {
 public:
  struct Limits {
    int calls = 256;   ///< calls that wait for the core, per client
    int streams = 64;  ///< open streams of all kinds, per client
    int all = 2560;    ///< calls and streams of all clients together
  };
  enum class Kind : std::uint8_t {
    reflection,    ///< a stream of gRPC's reflection
    health_watch,  ///< of gRPC's health service
    stream,        ///< of our own services
    read,          ///< a call that only looks at something
    motion,        ///< one that starts or changes something
  };
  /// A kind is let in while less than this of all places is taken.
  struct Share {
    Kind kind;
    int percent;
    std::string_view name;
  };
  /// What gives way where there is too much, in this order; stops never do.
  static constexpr std::array<Share, 5> shed_order{{{Kind::reflection, 20, "streams of reflection"},
                                                    {Kind::health_watch, 40, "watches of the health"},
                                                    {Kind::stream, 60, "streams"},
                                                    {Kind::read, 80, "calls that read"},
                                                    {Kind::motion, 100, "calls that change something"}}};
  /// A client with fewer calls may always make one that changes something: waiting for one axis must not keep
  /// it from moving the next.
  static constexpr int own_calls = 16;

 private:
  struct Counts {
    int calls = 0, streams = 0;
    [[nodiscard]] int& of(Kind kind) { return kind <= Kind::stream ? streams : calls; }
  };
  struct Book {
    std::mutex mutex;
    int taken = 0;  ///< by all clients
    std::unordered_map<std::string, Counts> clients;
  };

 public:
  /// One admitted call or stream; gives its place back when destroyed. May outlive the Admission.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&&) = default;
    Ticket& operator=(Ticket&& other) noexcept {
      release();
      book_ = std::move(other.book_);
      client_ = std::move(other.client_);
      kind_ = other.kind_;
      return *this;
    }
    ~Ticket() { release(); }
    void release();
    [[nodiscard]] const std::string& client() const { return client_; }

   private:
    friend class Admission;
    Ticket(std::shared_ptr<Book> book, std::string client, Kind kind)
        : book_(std::move(book)), client_(std::move(client)), kind_(kind) {}
    std::shared_ptr<Book> book_;
    std::string client_;
    Kind kind_ = Kind::motion;
  };

  explicit Admission(Limits limits) : limits_(limits), book_(std::make_shared<Book>()) {}
  /// However much others have, whoever has fewer than `own_calls` gets one that changes something, whoever
  /// has none gets one that reads, and whoever has no stream gets one of our own services. Errors: busy.
  [[nodiscard]] Result<Ticket> admit(const std::string& client, Kind kind);

 private:
  const Limits limits_;
  std::shared_ptr<Book> book_;
};

}  // namespace axisd::server
