//! Settings of pre-bent designs.

use tdcr::design;

use crate::settings::fields::{Count, Number, Unsigned, settings_class};
use crate::settings::rod::RodSettings;

settings_class! {
    /// Choices of a pre-bent design.
    PrebendSettings: design::PrebendSettings, checked by design::PrebendSettings::validate; {
        /// rod : RodSettings, optional
        ///     Of the rod model that the design is for.
        rod: RodSettings = None, "Settings of the rod model that the design is for.";

        /// max_bend : float, optional
        ///     Largest bend of a subsegment at rest, in (0, pi] [rad].
        max_bend: Number = 3.141592653589793, "Largest bend of a subsegment at rest [rad].";

        /// smoothness : float, optional
        ///     Weight of the differences between neighbouring rest bends [rad], against distances over the robot's
        ///     length: 0 for none. With it the least sum of both is the answer, and "converged".
        smoothness: Unsigned<Number> = 0.0,
            "Weight of the differences between neighbouring rest bends.";

        /// tolerance : float, optional
        ///     Distance of every disk from its wanted place that counts as reached, in shares of the robot's length.
        ///     In (0, 1e-2].
        tolerance: Number = 1e-10, "Distance that counts as reached, in shares of the robot's length.";

        /// max_iterations : int, optional
        ///     Levenberg-Marquardt steps of a start at most.
        max_iterations: Count = 100, "Levenberg-Marquardt steps of a start at most.";
    }

    /// Raises
    /// ------
    /// InvalidInput
    ///     A value out of range.
    /// TypeError
    ///     A value of another type.
    methods {}
}
