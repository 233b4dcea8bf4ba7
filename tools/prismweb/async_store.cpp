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

constexpr int kBuildingPages = 20, kLivePages = 2;  // from one commit to the next

Error hanging(std::chrono::steady_clock::duration busy) {
  const auto busy_s = std::chrono::duration_cast<std::chrono::seconds>(busy).count();
  return {"", fmt::format("the disk has not answered for {} s", busy_s)};
}

// One answer: the disk's, or that there is none in time.
template <class T>
struct Waiting {
  Waiting(asio::io_context& io, std::chrono::milliseconds timeout, AsyncStore::Answer<T> answer_)
      : late(io, timeout), answer(std::move(answer_)) {}

  void tell(const Result<T>& result) {
    if (!answer) return;
    late.cancel();
    std::exchange(answer, nullptr)(result);
  }

  asio::steady_timer late;
  AsyncStore::Answer<T> answer;
};

}  // namespace

// Of the disk's thread.
struct AsyncStore::Kept {
  std::string folder;
  std::optional<PeriodStore> store;
  std::string trouble;
  int uncommitted_pages = 0;

  void open() {
    auto opened = PeriodStore::open(folder);
    trouble = opened ? opened->rebuild_reason() : opened.error().text();
    if (opened) store.emplace(std::move(*opened));
  }

  void take(const std::vector<PeriodSummary>& seconds, const std::string& from, const std::string& to, bool building) {
    if (!store || from != store->cursor()) return;
    store->push(seconds, to);
    if (++uncommitted_pages >= (building ? kBuildingPages : kLivePages)) commit();
  }

  void commit() {
    uncommitted_pages = 0;
    const auto done = store->commit();
    trouble = done ? "" : done.error().text();
    begin_anew_if_damaged(done);
  }

  // What could not be removed is not served: it is opened, and found to be of another log or damaged, again.
  void clear() {
    uncommitted_pages = 0;
    store.reset();
    const auto removed = PeriodStore::remove(folder);
    trouble = removed ? "" : removed.error().text();
    if (removed) open();
  }

  template <class T>
  bool begin_anew_if_damaged(const Result<T>& result) {
    if (result || !store->is_damaged()) return false;
    clear();
    if (trouble.empty()) trouble = result.error().text() + kRebuilt;
    return true;
  }

  Known known() const {
    if (!store) return {{}, {}, {}, trouble, false};
    return {store->cursor(), store->first_second(), store->last_second(), trouble, true};
  }
};

AsyncStore::AsyncStore(asio::io_context& io, DiskThread& disk, std::string folder, std::chrono::milliseconds timeout)
    : io_(io), disk_(disk), timeout_(timeout), kept_(std::make_shared<Kept>()) {
  kept_->folder = std::move(folder);
}

// What fails by an exception (no memory) is the store's trouble as what fails by a refusal.
template <class Work>
void AsyncStore::run(Work work) {
  auto task = [kept = kept_, &io = io_, work = std::move(work), on_change = on_change_] {
    try {
      work(*kept);
    } catch (const std::exception& error) {
      kept->trouble = error.what();
    }
    asio::post(io, [on_change, known = kept->known()] { on_change(known); });
  };
  disk_.post(0, std::move(task));
}

void AsyncStore::open(OnChange on_change) {
  on_change_ = std::move(on_change);
  run([](Kept& kept) { kept.open(); });
}

void AsyncStore::take(std::vector<PeriodSummary> seconds, const std::string& from, const std::string& to,
                      bool building) {
  auto work = [seconds = std::move(seconds), from, to, building](Kept& kept) {
    kept.take(seconds, from, to, building);
  };
  run(std::move(work));
}

void AsyncStore::clear() {
  run([](Kept& kept) { kept.clear(); });
}

void AsyncStore::keep() {
  disk_.post(0, [kept = kept_] {
    if (kept->store && !kept->store->is_committed()) kept->commit();
  });
}

template <class T, class Work>
void AsyncStore::ask(Work work, Answer<T> answer) {
  const auto waiting = std::make_shared<Waiting<T>>(io_, timeout_, std::move(answer));
  const auto busy = disk_.busy_for();
  if (busy >= timeout_) {
    asio::post(io_, [waiting, busy] { waiting->tell(tl::unexpected<Error>(hanging(busy))); });
    return;
  }
  waiting->late.async_wait([waiting, timeout = timeout_](const boost::system::error_code& error) {
    if (!error) waiting->tell(tl::unexpected<Error>(hanging(timeout)));
  });
  auto task = [kept = kept_, &io = io_, work = std::move(work), waiting, on_change = on_change_] {
    Result<T> result = make_error("", kept->store ? "no memory is left to read minutes and hours" : kept->trouble);
    try {
      if (kept->store) {
        result = work(*kept);
        if (kept->begin_anew_if_damaged(result))
          asio::post(io, [on_change, known = kept->known()] { on_change(known); });
      }
    } catch (const std::exception&) {
    }
    asio::post(io, [waiting, result = std::move(result)] { waiting->tell(result); });
  };
  disk_.post(0, std::move(task));
}

void AsyncStore::cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer) {
  const auto work = [second](Kept& kept) -> Result<std::vector<std::string>> {
    return kept.store->cursors_before(second);
  };
  ask<std::vector<std::string>>(work, std::move(answer));
}

void AsyncStore::periods(const Query& query, Answer<Periods> answer) {
  const auto work = [query](Kept& kept) -> Result<Periods> {
    const auto all = kept.store->periods(query.step_s, query.from_s, query.to_s);
    if (!all) return tl::unexpected<Error>(all.error());
    return Periods{downsample(*all, query.from_s, query.to_s, query.step_s), kept.store->last_second()};
  };
  ask<Periods>(work, std::move(answer));
}

}  // namespace prism::prismweb
