//! Metrics, reports and charts.
