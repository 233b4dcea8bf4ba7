// SPDX-License-Identifier: MIT
#include "tools/prismweb/async_store.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <exception>
#include <utility>

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

constexpr int kBuildingPages = 20, kLivePages = 2;  // pages per commit

Error timeout_error(std::chrono::steady_clock::duration busy) {
  const auto busy_s = std::chrono::duration_cast<std::chrono::seconds>(busy).count();
  return {"", fmt::format("the disk has not answered for {} s", busy_s)};
}

// Calls `answer` once: with the disk's result or a timeout error.
template <class T>
struct PendingQuery {
  PendingQuery(asio::io_context& io, std::chrono::milliseconds timeout, AsyncStore::Answer<T> answer_)
      : timer(io, timeout), answer(std::move(answer_)) {}

  void finish(const Result<T>& result) {
    if (!answer) return;
    timer.cancel();
    std::exchange(answer, nullptr)(result);
  }

  asio::steady_timer timer;
  AsyncStore::Answer<T> answer;
};

}  // namespace

// Used only by the disk thread.
struct AsyncStore::State {
  std::string folder;
  std::optional<PeriodStore> store;
  std::string problem;
  int uncommitted_pages = 0;

  void open() {
    auto opened = PeriodStore::open(folder);
    problem = opened ? opened->rebuild_reason() : opened.error().text();
    if (opened) store.emplace(std::move(*opened));
  }

  void push(const std::vector<PeriodSummary>& seconds, const std::string& from, const std::string& to, bool building) {
    if (!store || from != store->cursor()) return;
    store->push(seconds, to);
    if (++uncommitted_pages >= (building ? kBuildingPages : kLivePages)) commit();
  }

  void commit() {
    uncommitted_pages = 0;
    const auto done = store->commit();
    problem = done ? "" : done.error().text();
    rebuild_if_damaged(done);
  }

  // If the store cannot be removed, it stays closed; the next open() detects the problem again.
  void clear() {
    uncommitted_pages = 0;
    store.reset();
    const auto removed = PeriodStore::remove(folder);
    problem = removed ? "" : removed.error().text();
    if (removed) open();
  }

  template <class T>
  bool rebuild_if_damaged(const Result<T>& result) {
    if (result || !store->is_damaged()) return false;
    clear();
    if (problem.empty()) problem = result.error().text() + kRebuilt;
    return true;
  }

  Status status() const {
    if (!store) return {{}, {}, {}, problem, false};
    return {store->cursor(), store->first_second(), store->last_second(), problem, true};
  }
};

AsyncStore::AsyncStore(asio::io_context& io, DiskThread& disk, std::string folder, std::chrono::milliseconds timeout)
    : io_(io), disk_(disk), timeout_(timeout), state_(std::make_shared<State>()) {
  state_->folder = std::move(folder);
}

// Reports an exception (out of memory) as a problem of the store, like an error.
template <class Work>
void AsyncStore::run(Work work) {
  auto task = [state = state_, &io = io_, work = std::move(work), on_change = on_change_] {
    try {
      work(*state);
    } catch (const std::exception& error) {
      state->problem = error.what();
    }
    asio::post(io, [on_change, status = state->status()] { on_change(status); });
  };
  disk_.post(0, std::move(task));
}

void AsyncStore::open(OnChange on_change) {
  on_change_ = std::move(on_change);
  run([](State& state) { state.open(); });
}

void AsyncStore::push(std::vector<PeriodSummary> seconds, const std::string& from, const std::string& to,
                      bool building) {
  auto work = [seconds = std::move(seconds), from, to, building](State& state) {
    state.push(seconds, from, to, building);
  };
  run(std::move(work));
}

void AsyncStore::clear() {
  run([](State& state) { state.clear(); });
}

void AsyncStore::commit() {
  disk_.post(0, [state = state_] {
    if (state->store && !state->store->is_committed()) state->commit();
  });
}

template <class T, class Work>
void AsyncStore::run_query(Work work, Answer<T> answer) {
  const auto pending = std::make_shared<PendingQuery<T>>(io_, timeout_, std::move(answer));
  const auto busy = disk_.busy_for();
  if (busy >= timeout_) {
    asio::post(io_, [pending, busy] { pending->finish(tl::unexpected<Error>(timeout_error(busy))); });
    return;
  }
  pending->timer.async_wait([pending, timeout = timeout_](const boost::system::error_code& error) {
    if (!error) pending->finish(tl::unexpected<Error>(timeout_error(timeout)));
  });
  auto task = [state = state_, &io = io_, work = std::move(work), pending, on_change = on_change_] {
    Result<T> result =
        make_error("", state->store ? "out of memory; minutes and hours cannot be read" : state->problem);
    try {
      if (state->store) {
        result = work(*state);
        if (state->rebuild_if_damaged(result))
          asio::post(io, [on_change, status = state->status()] { on_change(status); });
      }
    } catch (const std::exception&) {
    }
    asio::post(io, [pending, result = std::move(result)] { pending->finish(result); });
  };
  disk_.post(0, std::move(task));
}

void AsyncStore::cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer) {
  const auto work = [second](State& state) -> Result<std::vector<std::string>> {
    return state.store->cursors_before(second);
  };
  run_query<std::vector<std::string>>(work, std::move(answer));
}

void AsyncStore::periods(const Query& query, Answer<Periods> answer) {
  const auto work = [query](State& state) -> Result<Periods> {
    const auto all = state.store->periods(query.step_s, query.from_s, query.to_s);
    if (!all) return tl::unexpected<Error>(all.error());
    return Periods{downsample(*all, query.from_s, query.to_s, query.step_s), state.store->last_second()};
  };
  run_query<Periods>(work, std::move(answer));
}

}  // namespace prism::prismweb
