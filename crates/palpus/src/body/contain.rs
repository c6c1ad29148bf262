//! The solid's inside test and the test that no hull face leaves the solid.
