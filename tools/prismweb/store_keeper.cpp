// SPDX-License-Identifier: MIT
#include "tools/prismweb/store_keeper.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <exception>
#include <utility>

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

constexpr int kPagesACommit = 20;

Error hanging(std::chrono::steady_clock::duration busy) {
  return {"disk",
          fmt::format("has not answered for {} s", std::chrono::duration_cast<std::chrono::seconds>(busy).count())};
}

// One answer: the disk's, or that there is none in time.
template <class T>
struct Waiting {
  Waiting(asio::io_context& io, std::chrono::milliseconds patience, StoreKeeper::Answer<T> answer_)
      : late(io, patience), answer(std::move(answer_)) {}

  void tell(const Result<T>& result) {
    if (!answer) return;
    late.cancel();
    std::exchange(answer, nullptr)(result);
  }

  asio::steady_timer late;
  StoreKeeper::Answer<T> answer;
};

}  // namespace

// Of the disk's thread.
struct StoreKeeper::Kept {
  std::string folder;
  std::optional<Store> store;
  std::string trouble;
  int uncommitted_pages = 0;

  void open() {
    auto opened = Store::open(folder);
    trouble = opened ? opened->begun_anew() : opened.error().text();
    if (opened) store.emplace(std::move(*opened));
  }

  void take(const std::vector<Extremes>& seconds, const std::string& cursor, bool building) {
    if (!store) return;
    for (const Extremes& second : seconds) store->push(second);
    ++uncommitted_pages;
    const bool due = building ? uncommitted_pages >= kPagesACommit : store->has_ended_minute() || uncommitted_pages > 1;
    if (due) commit(cursor);
  }

  void commit(const std::string& cursor) {
    uncommitted_pages = 0;
    const auto done = store->commit(cursor);
    trouble = done ? "" : done.error().text();
  }

  // What could not be cleared is of another log, and is not served: it is opened, and cleared, again.
  void clear() {
    uncommitted_pages = 0;
    const auto done = store->clear();
    trouble = done ? "" : done.error().text();
    if (!done) store.reset();
  }

  Known known() const {
    if (!store) return {{}, {}, {}, trouble, false};
    return {store->cursor(), store->first_second(), store->last_second(), trouble, true};
  }
};

StoreKeeper::StoreKeeper(asio::io_context& io, DiskThread& disk, std::string folder, std::chrono::milliseconds patience)
    : io_(io), disk_(disk), patience_(patience), kept_(std::make_shared<Kept>()) {
  kept_->folder = std::move(folder);
}

// What fails by an exception (no memory) is the store's trouble as what fails by a refusal.
template <class Work>
void StoreKeeper::run(Work work, Told told) {
  auto task = [kept = kept_, &io = io_, work = std::move(work), told = std::move(told)] {
    try {
      work(*kept);
    } catch (const std::exception& error) {
      kept->trouble = error.what();
    }
    asio::post(io, [told, known = kept->known()] { told(known); });
  };
  disk_.post(0, std::move(task));
}

void StoreKeeper::open(Told told) {
  run([](Kept& kept) { kept.open(); }, std::move(told));
}

void StoreKeeper::take(std::vector<Extremes> seconds, const std::string& cursor, bool building, Told told) {
  auto work = [seconds = std::move(seconds), cursor, building](Kept& kept) { kept.take(seconds, cursor, building); };
  run(std::move(work), std::move(told));
}

void StoreKeeper::clear(Told told) {
  run([](Kept& kept) { kept.clear(); }, std::move(told));
}

void StoreKeeper::keep(const std::string& cursor) {
  disk_.post(0, [kept = kept_, cursor] {
    if (kept->store && !cursor.empty() && cursor != kept->store->cursor()) kept->commit(cursor);
  });
}

template <class T, class Work>
void StoreKeeper::ask(Work work, Answer<T> answer) {
  const auto waiting = std::make_shared<Waiting<T>>(io_, patience_, std::move(answer));
  const auto busy = disk_.busy_for();
  if (busy >= patience_) {
    asio::post(io_, [waiting, busy] { waiting->tell(tl::unexpected<Error>(hanging(busy))); });
    return;
  }
  waiting->late.async_wait([waiting, patience = patience_](const boost::system::error_code& error) {
    if (!error) waiting->tell(tl::unexpected<Error>(hanging(patience)));
  });
  auto task = [kept = kept_, &io = io_, work = std::move(work), waiting] {
    Result<T> result = refuse("disk", kept->store ? "is read by a thread that has no memory left" : kept->trouble);
    try {
      if (kept->store) result = work(*kept);
    } catch (const std::exception&) {
    }
    asio::post(io, [waiting, result = std::move(result)] { waiting->tell(result); });
  };
  disk_.post(0, std::move(task));
}

void StoreKeeper::cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer) {
  const auto work = [second](const Kept& kept) { return kept.store->cursors_before(second); };
  ask<std::vector<std::string>>(work, std::move(answer));
}

void StoreKeeper::periods(const Query& query, Answer<Periods> answer) {
  const auto work = [query](const Kept& kept) {
    const auto all =
        query.by_hours ? kept.store->hours(query.from_s, query.to_s) : kept.store->minutes(query.from_s, query.to_s);
    return Periods{thinned(all, query.from_s, query.to_s, query.step_s), kept.store->last_second()};
  };
  ask<Periods>(work, std::move(answer));
}

}  // namespace prism::prismweb
