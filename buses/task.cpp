#include "buses/task.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <exception>

namespace axisd {

void spawn(const Executor& executor, Task<> task, std::string name) {
  boost::asio::co_spawn(executor, std::move(task), [name = std::move(name)](const std::exception_ptr& error) {
    if (!error) return;
    try {
      std::rethrow_exception(error);
    } catch (const std::exception& exception) {
      spdlog::critical("sequence '{}' ended by an exception: {}", name, exception.what());
    }
    std::terminate();
  });
}

void post(const Executor& executor, std::function<void()> function) {
  boost::asio::post(executor, std::move(function));
}

}  // namespace axisd
