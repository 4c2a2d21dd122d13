//! Colour maps, for the values of a column.

use colorous::Gradient;

macro_rules! maps {
    ($($variant:ident $name:literal $gradient:ident),* $(,)?) => {
        /// A colour map.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum Map {
            #[default]
            $(
                #[serde(rename = $name)]
                #[doc = concat!("`", $name, "`.")]
                $variant,
            )*
        }

        impl Map {
            /// All.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// As in a scene file.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),* }
            }

            /// The map of that name.
            #[must_use]
            pub fn of_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|map| map.name() == name)
            }

            pub(super) fn gradient(self) -> Gradient {
                match self { $(Self::$variant => colorous::$gradient),* }
            }
        }
    };
}

maps![
    Viridis "viridis" VIRIDIS,
    Plasma "plasma" PLASMA,
    Inferno "inferno" INFERNO,
    Magma "magma" MAGMA,
    Cividis "cividis" CIVIDIS,
    Turbo "turbo" TURBO,
    RedBlue "red-blue" RED_BLUE,
    Spectral "spectral" SPECTRAL,
];
