-- SPDX-License-Identifier: MIT
-- Version 1 of the database of prismrelay: each row of each gyro's log once. See docs/fleet.md. Creates only what is missing.
-- prismrelay --init runs the files of this directory above the database's version, in one transaction. A change of the tables is a
-- further file, which ends with the new version: this one never changes, because databases have its tables.
CREATE SCHEMA IF NOT EXISTS prism;

CREATE TABLE IF NOT EXISTS prism.version (version integer PRIMARY KEY);
INSERT INTO prism.version SELECT 1 WHERE NOT EXISTS (SELECT FROM prism.version);

-- A row of a log. The key is its position in the log, and the arrival, because the table is partitioned by it.
-- Each key and join starts with the gyro: with Citus, distribute all tables by that column.
CREATE TABLE IF NOT EXISTS prism.rows (
  gyro text NOT NULL,             -- SITE/NAME
  axis text NOT NULL,
  log uuid NOT NULL,              -- the id in the log's index; an emptied directory gets a new one
  segment integer NOT NULL,
  row_number integer NOT NULL,    -- in the segment, from 1
  arrival timestamptz NOT NULL,   -- host time of the last frame of the second
  time timestamptz NOT NULL,      -- end of the second, in data time
  samples integer,
  missing bigint,
  rate_deg_per_h double precision,
  temperature_degc double precision,
  uhfo_v double precision,
  status bigint,
  mean_rate_deg_per_h double precision,
  mean_temperature_degc double precision,
  slope_degc_per_s double precision,
  mean_uhfo_v double precision,
  bias_deg_per_h double precision,
  sd_deg_per_h double precision,
  corrected_deg_per_h double precision,
  corrected_mean_deg_per_h double precision,
  quality text,
  sd_mean_deg_per_h double precision,
  partial smallint,
  sensors jsonb,                  -- values by column name
  PRIMARY KEY (gyro, axis, log, segment, row_number, arrival)
) PARTITION BY RANGE (arrival);
CREATE INDEX IF NOT EXISTS rows_arrival ON prism.rows USING brin (arrival);

-- Metadata of each segment: model id, frame description, site and mounting of the axis.
CREATE TABLE IF NOT EXISTS prism.segments (
  gyro text NOT NULL,
  axis text NOT NULL,
  log uuid NOT NULL,
  segment integer NOT NULL,
  file text NOT NULL,
  model text,                     -- id and name
  metadata jsonb NOT NULL,
  noticed timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (gyro, axis, log, segment)
);

-- Cursor after the last row of each log, written in the same transaction as the rows.
CREATE TABLE IF NOT EXISTS prism.places (
  gyro text NOT NULL,
  axis text NOT NULL,
  cursor text NOT NULL,
  log uuid,
  segment integer,
  row_number integer,
  arrival timestamptz,
  rows bigint NOT NULL,           -- stored since the first row of the gyro
  updated timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (gyro, axis)
);

-- Lost data: rows deleted before they were read, and ends of logs whose directory was emptied.
CREATE TABLE IF NOT EXISTS prism.gaps (
  gyro text NOT NULL,
  axis text NOT NULL,
  noticed timestamptz NOT NULL DEFAULT now(),
  kind text NOT NULL,             -- deleted, or log_changed
  behind text NOT NULL,           -- the cursor before the gap
  missing bigint NOT NULL,
  PRIMARY KEY (gyro, axis, behind, kind)
);

-- Invalid lines of a log: their first 1000 bytes.
CREATE TABLE IF NOT EXISTS prism.refused_rows (
  gyro text NOT NULL,
  axis text NOT NULL,
  log uuid NOT NULL,
  segment integer NOT NULL,
  row_number integer NOT NULL,
  why text NOT NULL,
  line text NOT NULL,
  PRIMARY KEY (gyro, axis, log, segment, row_number)
);

-- Events of prismd.
CREATE TABLE IF NOT EXISTS prism.events (
  gyro text NOT NULL,
  time timestamptz NOT NULL,
  severity text NOT NULL,
  kind text NOT NULL,
  text text NOT NULL,
  PRIMARY KEY (gyro, time, kind, text)
);

-- The last row of each gyro and axis.
CREATE OR REPLACE VIEW prism.latest AS
SELECT p.gyro, p.axis, p.rows AS rows_carried, p.updated, r.arrival, r.time, r.rate_deg_per_h, r.bias_deg_per_h, r.sd_deg_per_h,
       r.corrected_deg_per_h, r.corrected_mean_deg_per_h, r.temperature_degc, r.uhfo_v, r.quality, s.model
FROM prism.places p
LEFT JOIN prism.rows r ON r.gyro = p.gyro AND r.axis = p.axis AND r.log = p.log AND r.segment = p.segment
                      AND r.row_number = p.row_number AND r.arrival = p.arrival
LEFT JOIN prism.segments s ON s.gyro = p.gyro AND s.axis = p.axis AND s.log = p.log AND s.segment = p.segment;

-- Means by hour of arrival, without partial seconds.
CREATE OR REPLACE VIEW prism.hourly AS
SELECT gyro, axis, date_trunc('hour', arrival) AS hour, count(*) AS seconds, sum(missing) AS missing_frames,
       avg(rate_deg_per_h) AS rate_deg_per_h, avg(corrected_deg_per_h) AS corrected_deg_per_h, avg(bias_deg_per_h) AS bias_deg_per_h,
       avg(temperature_degc) AS temperature_degc, avg(uhfo_v) AS uhfo_v,
       (count(*) FILTER (WHERE quality = 'good'))::double precision / count(*) AS good
FROM prism.rows
WHERE partial IS DISTINCT FROM 1
GROUP BY gyro, axis, date_trunc('hour', arrival);

-- Bias stability of a day: standard deviation of 100 s means (Tao et al. 2019), raw and corrected. Each row has the mean of the
-- 100 s before it, so only one row in 100 s is used.
CREATE OR REPLACE VIEW prism.stability AS
SELECT gyro, axis, date_trunc('day', arrival) AS day, count(*) AS blocks,
       stddev_samp(mean_rate_deg_per_h) FILTER (WHERE corrected_mean_deg_per_h IS NOT NULL) AS raw_deg_per_h,
       stddev_samp(corrected_mean_deg_per_h) AS corrected_deg_per_h
FROM prism.rows
WHERE partial IS DISTINCT FROM 1 AND slope_degc_per_s IS NOT NULL AND extract(epoch FROM time)::bigint % 100 = 0
GROUP BY gyro, axis, date_trunc('day', arrival);

-- The stored days and the size of each.
CREATE OR REPLACE VIEW prism.days AS
SELECT to_date(right(c.relname, 8), 'YYYYMMDD') AS day, c.reltuples::bigint AS rows_about, pg_total_relation_size(c.oid) AS bytes
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid
WHERE i.inhparent = 'prism.rows'::regclass AND c.relname ~ '^rows_[0-9]{8}$';
