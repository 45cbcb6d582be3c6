//! One macro that writes a settings class of Python from a struct of the core, a setting at a time, and the kinds
//! of values that settings have.

use std::marker::PhantomData;

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedStr;
use pyo3::types::PyDict;

use tdcr::InvalidInput;

use crate::convert::arguments::{number, whole};
use crate::convert::arrays::invalid;

/// Kind of a setting: its value in the core, and how Python reads and writes it.
pub(crate) trait Kind {
    /// Value in the core's struct.
    type Value;

    /// Value of an argument.
    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Self::Value>;

    /// Value for Python; the class takes it back.
    fn show<'py>(py: Python<'py>, value: &Self::Value) -> PyResult<Bound<'py, PyAny>>;

    /// Text in a repr.
    fn text(py: Python<'_>, value: &Self::Value) -> PyResult<String> {
        Self::show(py, value)?.repr()?.extract()
    }
}

/// Kinds whose values Python knows as they are.
macro_rules! plain_kinds {
    ($($(#[doc = $doc:tt])* $kind:ident: $value:ty = $read:expr;)+) => {
        $(
            $(#[doc = $doc])*
            pub(crate) struct $kind;

            impl Kind for $kind {
                type Value = $value;

                fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<$value> {
                    let read: fn(&str, &Bound<'_, PyAny>) -> PyResult<$value> = $read;
                    read(argument, value)
                }

                fn show<'py>(py: Python<'py>, value: &$value) -> PyResult<Bound<'py, PyAny>> {
                    value.into_bound_py_any(py)
                }
            }
        )+
    };
}

plain_kinds! {
    /// Everything that Python's `float` takes.
    Float: f64 = |_, value| value.extract();
    /// A number, which True and False are not.
    Number: f64 = number;
    /// A whole number of 0 or more.
    Count: usize = whole;
    /// A whole number of 0 or more that random draws start from.
    Seed: u64 = |argument, value| whole(argument, value).map(|seed| seed as u64);
    /// True or False.
    Flag: bool = |_, value| value.extract();
}

/// A number with -0.0 made 0.0, so that equal settings have equal reprs.
pub(crate) struct Unsigned<K>(PhantomData<K>);

impl<K: Kind<Value = f64>> Kind for Unsigned<K> {
    type Value = f64;

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
        Ok(K::read(argument, value)? + 0.0)
    }

    fn show<'py>(py: Python<'py>, value: &f64) -> PyResult<Bound<'py, PyAny>> {
        K::show(py, value)
    }
}

/// A value, or None.
pub(crate) struct Optional<K>(PhantomData<K>);

impl<K: Kind> Kind for Optional<K> {
    type Value = Option<K::Value>;

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<Self::Value> {
        if value.is_none() { Ok(None) } else { K::read(argument, value).map(Some) }
    }

    fn show<'py>(py: Python<'py>, value: &Self::Value) -> PyResult<Bound<'py, PyAny>> {
        value.as_ref().map_or_else(|| Ok(py.None().into_bound(py)), |value| K::show(py, value))
    }
}

/// A few values of the core that Python knows by name.
pub(crate) trait Choice: Copy + 'static {
    /// All of them.
    const ALL: &'static [Self];
    /// Words before and between the names in the message about another one.
    const WORDS: [&'static str; 2];

    /// Name in Python.
    fn name(self) -> &'static str;

    /// Value of a name.
    fn from_name(argument: &str, name: &str) -> PyResult<Self> {
        Self::ALL.iter().copied().find(|known| known.name() == name).ok_or_else(|| {
            let names: Vec<_> =
                Self::ALL.iter().map(|known| format!("\"{}\"", known.name())).collect();
            let [before, between] = Self::WORDS;
            let expected = format!("{before}{}", names.join(between));
            invalid(&InvalidInput::new(argument, expected, format!("\"{name}\"")))
        })
    }
}

/// Enums of the core as choices, with the words of their messages.
macro_rules! choices {
    ($words:expr; $($choice:ty),+) => {
        $(
            impl $crate::settings::fields::Choice for $choice {
                const ALL: &'static [Self] = &<$choice>::ALL;
                const WORDS: [&'static str; 2] = $words;

                fn name(self) -> &'static str {
                    self.as_str()
                }
            }
        )+
    };
}
pub(crate) use choices;

/// One of a few names.
pub(crate) struct OneOf<C>(PhantomData<C>);

impl<C: Choice> Kind for OneOf<C> {
    type Value = C;

    fn read(argument: &str, value: &Bound<'_, PyAny>) -> PyResult<C> {
        C::from_name(argument, &value.extract::<PyBackedStr>()?)
    }

    fn show<'py>(py: Python<'py>, value: &C) -> PyResult<Bound<'py, PyAny>> {
        value.name().into_bound_py_any(py)
    }
}

/// Keywords that a class knows.
pub(crate) fn check_keywords(
    class: &str,
    keywords: Option<&Bound<'_, PyDict>>,
    known: &[&str],
) -> PyResult<()> {
    for name in keywords.into_iter().flat_map(PyDictMethods::keys) {
        let name: PyBackedStr = name.extract()?;
        if !known.contains(&&*name) {
            let message = format!("{class}.__new__() got an unexpected keyword argument '{name}'");
            return Err(PyTypeError::new_err(message));
        }
    }
    Ok(())
}

/// Value of a keyword, or the default where it is missing.
pub(crate) fn keyword<K: Kind>(
    keywords: Option<&Bound<'_, PyDict>>,
    name: &str,
    default: K::Value,
) -> PyResult<K::Value> {
    let given = keywords.map(|keywords| keywords.get_item(name)).transpose()?.flatten();
    let Some(given) = given else { return Ok(default) };
    K::read(name, &given).inspect_err(|error| {
        // As for the arguments of functions.
        let note = format!("while processing '{name}'");
        let _ = error.value(given.py()).call_method1("add_note", (note,));
    })
}

/// A settings class: the core's struct, its check, and a line for every setting with its documentation, its kind,
/// the default that the signature shows (the core's `Default` is the one that counts) and the getter's docstring.
macro_rules! settings_class {
    (
        $(#[doc = $summary:tt])*
        $class:ident: $core:ty, checked by $check:expr; {
            $(
                $(#[doc = $parameter:tt])*
                $name:ident: $kind:ty = $shown:tt, $getter:tt;
            )+
        }
        $(#[doc = $raises:tt])*
        methods { $($methods:tt)* }
    ) => {
        #[doc = concat!(
            stringify!($class), "(*", $(", ", stringify!($name), "=", stringify!($shown),)+ ")\n--\n"
        )]
        $(#[doc = $summary])*
        #[doc = ""]
        #[doc = "Parameters"]
        #[doc = "----------"]
        $($(#[doc = $parameter])*)+
        #[doc = ""]
        $(#[doc = $raises])*
        #[pyo3::pyclass(frozen, eq, module = "tdcr")]
        #[derive(Clone, Default, PartialEq)]
        pub(crate) struct $class(pub(crate) $core);

        impl $class {
            /// Keywords of the constructor that give these settings.
            pub(crate) fn keywords<'py>(
                &self,
                py: pyo3::Python<'py>,
            ) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyDict>> {
                use pyo3::types::PyDictMethods as _;
                use $crate::settings::fields::Kind as _;
                let keywords = pyo3::types::PyDict::new(py);
                $(keywords.set_item(stringify!($name), <$kind>::show(py, &self.0.$name)?)?;)+
                Ok(keywords)
            }
        }

        #[pyo3::pymethods]
        impl $class {
            #[new]
            #[pyo3(signature = (**keywords), text_signature = None)]
            fn new(
                keywords: Option<&pyo3::Bound<'_, pyo3::types::PyDict>>,
            ) -> pyo3::PyResult<Self> {
                use $crate::settings::fields;
                fields::check_keywords(stringify!($class), keywords, &[$(stringify!($name)),+])?;
                let mut settings = <$core>::default();
                $(settings.$name = fields::keyword::<$kind>(keywords, stringify!($name), settings.$name)?;)+
                let check: fn(&$core) -> Result<(), tdcr::InvalidInput> = $check;
                check(&settings).map_err(|e| $crate::convert::arrays::invalid(&e))?;
                Ok(Self(settings))
            }

            $(
                #[doc = $getter]
                #[getter]
                fn $name<'py>(
                    &self,
                    py: pyo3::Python<'py>,
                ) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::PyAny>> {
                    <$kind as $crate::settings::fields::Kind>::show(py, &self.0.$name)
                }
            )+

            fn __hash__(&self, py: pyo3::Python<'_>) -> pyo3::PyResult<isize> {
                use pyo3::types::{PyAnyMethods as _, PyDictMethods as _};
                pyo3::types::PyTuple::new(py, self.keywords(py)?.values())?.hash()
            }

            fn __repr__(&self, py: pyo3::Python<'_>) -> pyo3::PyResult<String> {
                use $crate::settings::fields::Kind as _;
                let settings = [$(
                    format!("{}={}", stringify!($name), <$kind>::text(py, &self.0.$name)?)
                ),+];
                Ok(format!("{}({})", stringify!($class), settings.join(", ")))
            }

            fn __getnewargs_ex__<'py>(
                &self,
                py: pyo3::Python<'py>,
            ) -> pyo3::PyResult<(
                pyo3::Bound<'py, pyo3::types::PyTuple>,
                pyo3::Bound<'py, pyo3::types::PyDict>,
            )> {
                Ok((pyo3::types::PyTuple::empty(py), self.keywords(py)?))
            }

            $($methods)*
        }
    };
}
pub(crate) use settings_class;
