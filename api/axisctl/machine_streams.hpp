// One stream to each of several machines of a cell, for as long as somebody looks.
#pragma once

#include <grpcpp/client_context.h>

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "api/axisctl/across.hpp"

namespace axisd::axisctl {

/// Opens a stream to each machine that is selected, those that come later included, and again once it was
/// lost.
class MachineStreams {
 public:
  /// Reads one stream to its end; returns why it ended. Runs on a thread of that machine's own.
  using Read =
      std::function<Failure(const Client& machine, grpc::ClientContext& context, const std::string& name)>;
  /// Told whenever a machine is in another trouble than before; nothing: in none. Thread: that machine's.
  using Tell = std::function<void(const std::string& name, const std::optional<Failure>& trouble)>;

  MachineStreams(Invocation& invocation, const Selection& selection, Read read, Tell tell);
  MachineStreams(const MachineStreams&) = delete;
  MachineStreams& operator=(const MachineStreams&) = delete;
  ~MachineStreams();

  /// Until Ctrl-C or end(). Throws Failure where the entrance does not answer, or a machine that was named
  /// refuses.
  void run();
  /// Thread: any.
  void end();
  /// This machine sends. Thread: its own.
  void flows(const std::string& name);

 private:
  struct Machine {
    std::thread thread;
    grpc::ClientContext* context = nullptr;  ///< of the stream that is open
    std::string trouble;                     ///< as it was told
  };

  void open(const std::string& name);
  void follow(const std::string& name);
  void refused(const std::string& name, const Failure& why);
  void note(const std::string& name, const std::optional<Failure>& trouble);

  Invocation& invocation_;
  const Selection& selection_;
  const Read read_;
  const Tell tell_;
  grpc::ClientContext machines_;  ///< of the stream that tells which there are
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::optional<Failure> refusal_;
  std::map<std::string, Machine> open_;
};

}  // namespace axisd::axisctl
