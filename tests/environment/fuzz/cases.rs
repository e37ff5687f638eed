//! Inputs that failed once, cut down to what matters.
