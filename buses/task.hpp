// Coroutines of the core thread. Everything above buses/ uses these names, not Asio's.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <functional>
#include <string>

namespace axisd {

template <class T = void>
using Task = boost::asio::awaitable<T>;

using Executor = boost::asio::any_io_executor;

/// Runs `task` on the core thread until it ends. An exception that leaves it ends the process: a sequence
/// that died silently would leave its axis without an owner, and `--quiesce` after the exit stops the drives.
void spawn(const Executor& executor, Task<> task, std::string name);

/// Runs `function` on the core thread, later. Thread: any.
void post(const Executor& executor, std::function<void()> function);

}  // namespace axisd
