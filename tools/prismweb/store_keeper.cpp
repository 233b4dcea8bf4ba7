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

constexpr int kBuildingPages = 20, kLivePages = 2;  // from one commit to the next

Error hanging(std::chrono::steady_clock::duration busy) {
  const auto busy_s = std::chrono::duration_cast<std::chrono::seconds>(busy).count();
  return {"", fmt::format("the disk has not answered for {} s", busy_s)};
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

  void take(const std::vector<Extremes>& seconds, const std::string& from, const std::string& to, bool building) {
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
    const auto removed = Store::remove(folder);
    trouble = removed ? "" : removed.error().text();
    if (removed) open();
  }

  template <class T>
  bool begin_anew_if_damaged(const Result<T>& result) {
    if (result || !store->is_damaged()) return false;
    clear();
    if (trouble.empty()) trouble = result.error().text() + kBuiltAgain;
    return true;
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
void StoreKeeper::run(Work work) {
  auto task = [kept = kept_, &io = io_, work = std::move(work), told = told_] {
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
  told_ = std::move(told);
  run([](Kept& kept) { kept.open(); });
}

void StoreKeeper::take(std::vector<Extremes> seconds, const std::string& from, const std::string& to, bool building) {
  auto work = [seconds = std::move(seconds), from, to, building](Kept& kept) {
    kept.take(seconds, from, to, building);
  };
  run(std::move(work));
}

void StoreKeeper::clear() {
  run([](Kept& kept) { kept.clear(); });
}

void StoreKeeper::keep() {
  disk_.post(0, [kept = kept_] {
    if (kept->store && !kept->store->is_kept()) kept->commit();
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
  auto task = [kept = kept_, &io = io_, work = std::move(work), waiting, told = told_] {
    Result<T> result = make_error("", kept->store ? "no memory is left to read minutes and hours" : kept->trouble);
    try {
      if (kept->store) {
        result = work(*kept);
        if (kept->begin_anew_if_damaged(result)) asio::post(io, [told, known = kept->known()] { told(known); });
      }
    } catch (const std::exception&) {
    }
    asio::post(io, [waiting, result = std::move(result)] { waiting->tell(result); });
  };
  disk_.post(0, std::move(task));
}

void StoreKeeper::cursors_before(std::int64_t second, Answer<std::vector<std::string>> answer) {
  const auto work = [second](Kept& kept) -> Result<std::vector<std::string>> {
    return kept.store->cursors_before(second);
  };
  ask<std::vector<std::string>>(work, std::move(answer));
}

void StoreKeeper::periods(const Query& query, Answer<Periods> answer) {
  const auto work = [query](Kept& kept) -> Result<Periods> {
    const auto all = kept.store->periods(query.step_s, query.from_s, query.to_s);
    if (!all) return tl::unexpected<Error>(all.error());
    return Periods{thinned(*all, query.from_s, query.to_s, query.step_s), kept.store->last_second()};
  };
  ask<Periods>(work, std::move(answer));
}

}  // namespace prism::prismweb
